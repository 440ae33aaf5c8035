// ecaudit_write_trace TRACE OUT.pcapng: writes the packets of a trace (tests/support/trace_builder.h) as a capture.
#include <cstdio>
#include <fstream>

#include "tests/support/trace_file.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: ecaudit_write_trace TRACE OUT.pcapng\n");
    return 2;
  }
  const auto trace = ecaudit::test::Trace::Load(argv[1]);
  if (!trace) {
    std::fprintf(stderr, "%s\n", trace.error().message.c_str());
    return 2;
  }
  const ecaudit::samples::Bytes bytes = ecaudit::test::PcapNgOf(*trace);
  std::ofstream file(argv[2], std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (file.fail()) std::fprintf(stderr, "cannot write %s\n", argv[2]);
  return file.fail() ? 2 : 0;
}
