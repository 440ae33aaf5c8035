// ecaudit_pcap_loop FILE: libpcap's bare read loop, the yardstick of the benchmark.
#include <cstdint>
#include <cstdio>

#include <pcap/pcap.h>

int main(int argc, char** argv) {
  char problem[PCAP_ERRBUF_SIZE] = "";
  pcap_t* file = argc == 2 ? pcap_open_offline(argv[1], problem) : nullptr;
  if (file == nullptr) {
    std::fprintf(stderr, "usage: ecaudit_pcap_loop FILE\n%s\n", problem);
    return 2;
  }
  pcap_pkthdr* header = nullptr;
  const u_char* bytes = nullptr;
  std::uint64_t packets = 0;
  std::uint64_t total = 0;
  while (pcap_next_ex(file, &header, &bytes) == 1) {
    ++packets;
    total += header->caplen;
  }
  pcap_close(file);
  std::printf("%llu packets, %llu bytes\n", static_cast<unsigned long long>(packets),
              static_cast<unsigned long long>(total));
  return 0;
}
