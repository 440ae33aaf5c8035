#include "decoder/device/source_documents.h"

#include <algorithm>
#include <array>

namespace ecaudit::device {
namespace {

constexpr auto kDocuments = std::to_array<SourceDocument>({
    {"AKD-2010", "Kollmorgen AKD EtherCAT Communication, edition B, October 2010"},
    {"AKD-2011", "Kollmorgen AKD EtherCAT Kommunikation, revision D, April 2011 (German)"},
    {"AKD-CAPTURE", "Capture of a Kollmorgen AKD, revision 2 (ethercrab, dumps/soem-sdinfo-akd.pcapng)"},
    {"AKD-UG", "Kollmorgen AKD User Guide, December 2010"},
    {"CIA301", "CiA 301, CANopen application layer and communication profile"},
    {"CIA402", "CiA 402 / IEC 61800-7-201, drives and motion control"},
    {"ENI", "EtherCAT network information file given by the user"},
    {"ESC-1", "Beckhoff EtherCAT Slave Controller data sheet, section I, technology"},
    {"ESC-2", "Beckhoff EtherCAT Slave Controller data sheet, section II, register description, version 2.7"},
    {"ESI", "EtherCAT slave information file given by the user"},
    {"ETG1000.3", "ETG.1000.3 / IEC 61158-3-12, EtherCAT data link layer service"},
    {"ETG1000.4", "ETG.1000.4 / IEC 61158-4-12, EtherCAT data link layer protocol"},
    {"ETG1000.5", "ETG.1000.5 / IEC 61158-5-12, EtherCAT application layer service"},
    {"ETG1000.6", "ETG.1000.6 / IEC 61158-6-12, EtherCAT application layer protocol"},
    {"ETG1020", "ETG.1020, EtherCAT protocol enhancements"},
    {"ETG1300", "ETG.1300, EtherCAT indicator and labelling specification"},
    {"ETG2000", "ETG.2000, EtherCAT slave information (ESI)"},
    {"ETG2010", "ETG.2010, EtherCAT slave information interface (EEPROM)"},
    {"ETG2100", "ETG.2100, EtherCAT network information (ENI)"},
    {"ETG5001", "ETG.5001, modular device profile"},
    {"ETHERCRAB", "ethercrab, EtherCAT master in Rust, with captures of real hardware"},
    {"IGH", "IgH EtherCAT master (EtherLab)"},
    {"KICKCAT", "KickCAT, EtherCAT master and slave stack"},
    {"MKD", "Kollmorgen MKD EtherCAT, edition B, October 2020, firmware 2.0"},
    {"MKD-WEB", "Kollmorgen developer network, flexible PDO mapping"},
    {"PCAP", "libpcap capture file format (pcap-savefile)"},
    {"PCAPNG", "PCAP Next Generation capture file format (draft-ietf-opsawg-pcapng)"},
    {"PILZ", "Pilz EtherCAT for PMCtendo DD5 and PMCprotego D"},
    {"SOEM", "SOEM, simple open EtherCAT master"},
    {"SOES", "SOES, simple open EtherCAT slave"},
    {"SSC", "Beckhoff EtherCAT slave stack code, version 5.13"},
    {"TI-ESC", "TI PRU-ICSS EtherCAT slave controller register list (ET1100 compatible)"},
    {"TWINCAT", "Beckhoff TwinCAT, behaviour seen in captures of real hardware"},
    {"WIRESHARK", "Wireshark 4.0, EtherCAT dissectors"},
});

}  // namespace

std::span<const SourceDocument> SourceDocuments() {
  return kDocuments;
}

const SourceDocument* FindSourceDocument(std::string_view key) {
  const auto it = std::ranges::lower_bound(kDocuments, key, {}, &SourceDocument::key);
  return it != kDocuments.end() && it->key == key ? &*it : nullptr;
}

Citation FirstCitation(std::string_view source) {
  const std::string_view first = source.substr(0, source.find(';'));
  const std::size_t comma = first.find(", ");
  if (comma == std::string_view::npos) return {first, {}};
  return {first.substr(0, comma), first.substr(comma + 2)};
}

}  // namespace ecaudit::device
