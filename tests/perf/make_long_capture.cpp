// ecaudit_make_long_capture SLAVES FRAMES FILE: a healthy capture of that length; FILE.pcap or FILE.pcapng.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/perf/long_run.h"

int main(int argc, char** argv) {
  using namespace ecaudit;
  perf::LongRun run;
  if (argc == 4) {
    run.slaves = static_cast<std::size_t>(std::strtoul(argv[1], nullptr, 10));
    run.frames = std::strtoull(argv[2], nullptr, 10);
  }
  if (argc != 4 || run.slaves == 0 || run.slaves > 100 || run.frames == 0) {
    std::fprintf(stderr, "usage: ecaudit_make_long_capture SLAVES FRAMES FILE.pcap|FILE.pcapng\n");
    return 2;
  }
  const std::string path = argv[3];
  run.format = path.ends_with(".pcap") ? samples::FileFormat::kPcapNano : samples::FileFormat::kPcapNg;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  const std::uint64_t packets = perf::WriteLongRun(run, [&](const samples::Bytes& piece) {
    file.write(reinterpret_cast<const char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
  });
  file.close();
  if (!file) {
    std::fprintf(stderr, "cannot write %s\n", path.c_str());
    return 1;
  }
  std::printf("%s: %llu frames\n", path.c_str(), static_cast<unsigned long long>(packets));
  return 0;
}
