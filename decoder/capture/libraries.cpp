#include "decoder/capture/libraries.h"

#include <string_view>

#include <pcap/pcap.h>
#include <zlib.h>
#include <zstd.h>

namespace ecaudit::capture {

std::string LibraryVersions() {
  // "libpcap version 1.10.3 (with TPACKET_V3)"
  std::string_view pcap = pcap_lib_version();
  constexpr std::string_view kBefore = "libpcap version ";
  if (pcap.starts_with(kBefore)) pcap.remove_prefix(kBefore.size());
  pcap = pcap.substr(0, pcap.find(' '));
  return "libpcap " + std::string(pcap) + ", zlib " + zlibVersion() + ", zstd " + ZSTD_versionString();
}

}  // namespace ecaudit::capture
