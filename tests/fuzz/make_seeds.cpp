// ecaudit_make_fuzz_seeds CORPUS_DIR: seeds of fuzz_analysis and fuzz_bus, made with the sample builder.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <zlib.h>

#include "samples/builder/scenarios/scenario.h"
#include "tests/fuzz/bus_addresses.h"

namespace ecaudit::fuzz {
namespace {

using samples::Bytes;
using samples::Story;

/// Names that would take over a terminal or a web page.
constexpr const char* kEvil = "\x1b]0;owned\x07\x1b[2J</script><img src=x onerror=alert(1)>&\"'\xff\xc0\x80";

Bytes Gzip(const Bytes& plain) {
  z_stream state{};
  constexpr int kGzip = 16;
  deflateInit2(&state, 9, Z_DEFLATED, MAX_WBITS + kGzip, 8, Z_DEFAULT_STRATEGY);
  Bytes out(deflateBound(&state, plain.size()));
  state.next_in = const_cast<Bytef*>(plain.data());
  state.avail_in = static_cast<uInt>(plain.size());
  state.next_out = out.data();
  state.avail_out = static_cast<uInt>(out.size());
  deflate(&state, Z_FINISH);
  out.resize(state.total_out);
  deflateEnd(&state);
  return out;
}

/// Scan and PREOP, with names that nobody should print as they are.
void ToPreop(Story& story) {
  samples::SlaveDescription drive = samples::AkdDrive();
  drive.sii.name = kEvil;
  drive.sii.group = kEvil;
  drive.objects.Find(0x1008, 0)->value.assign(kEvil, kEvil + std::char_traits<char>::length(kEvil));
  story.Add(std::move(drive));
  story.master.Scan();
  story.master.BringToPreop();
  story.master.Upload(0, 0x1008, 0);
  story.master.Download(0, 0x2FFF, 0, {1, 2});
}

/// From SAFEOP on: process data, a fault, a lost frame.
void Run(Story& story) {
  samples::SimulatedSlave& drive = story.Add(samples::AkdDrive());
  story.capture.Pause();
  story.master.Scan();
  story.capture.Resume();
  for (const int word : {0x08, 0x0A, 0x0C}) story.master.ReadEeprom(0, static_cast<std::uint16_t>(word));
  story.capture.Pause();
  story.master.BringToPreop();
  story.capture.Resume();
  for (const int assignment : {0x1C12, 0x1C13}) {
    for (const int subindex : {0, 1}) {
      story.master.Upload(0, static_cast<std::uint16_t>(assignment), static_cast<std::uint8_t>(subindex));
    }
  }
  story.master.SetUpClocks(2);
  story.master.BringToSafeop();
  story.master.StartSync0(0, 1'000'000);
  story.master.BringToOp({.distributes_time = true, .reads_al_status = true});
  story.EnableDrive(0);
  story.master.LoseNext(1);
  story.Move(0, 0, 1000, 5);
  drive.drive().FaultAt(story.master.now());
  drive.coe().QueueEmergency(story.master.now(), 0x7305, 1, {1, 2, 3, 4, 5});
  story.master.Cycles(5);
  story.master.ReadMailbox(0, 5'000'000);
  story.master.ShutDown();
}

/// The frames of a story in the language of fuzz_bus.
Bytes Compact(Story& story, std::size_t packets) {
  constexpr std::size_t kEthernet = 14;
  Bytes out;
  for (std::size_t i = 0; i + 1 < packets; i += 2) {
    const Bytes& sent = story.capture.bytes(i);
    const Bytes& returned = story.capture.bytes(i + 1);
    Bytes frame{0, 5};
    std::size_t at = kEthernet + 2;
    std::size_t datagrams = 0;
    for (bool more = true; more && datagrams < 4 && at + 12 <= sent.size() && returned.size() >= sent.size();) {
      const auto length_word = samples::LoadLe<std::uint16_t>(sent, at + 6);
      const std::size_t length = length_word & 0x7FFU;
      const auto command = static_cast<samples::Cmd>(sent[at]);
      std::optional<std::uint8_t> address;
      if (samples::CmdIsLogical(command)) {
        address = static_cast<std::uint8_t>(samples::LoadLe<std::uint32_t>(sent, at + 2) / 4 & 0x0FU);
      } else {
        const auto found =
            std::find(kBusAddresses.begin(), kBusAddresses.end(), samples::LoadLe<std::uint16_t>(sent, at + 4));
        if (found != kBusAddresses.end()) address = static_cast<std::uint8_t>(found - kBusAddresses.begin());
      }
      if (address && length < 160) {
        const Bytes& data = samples::CmdWrites(command) ? sent : returned;
        frame.push_back(sent[at]);
        frame.push_back(*address);
        frame.push_back(returned[at + 10 + length]);
        frame.push_back(static_cast<std::uint8_t>(length));
        frame.insert(frame.end(), data.begin() + static_cast<std::ptrdiff_t>(at + 10),
                     data.begin() + static_cast<std::ptrdiff_t>(at + 10 + length));
        ++datagrams;
      }
      more = (length_word & 0x8000U) != 0;
      at += 12 + length;
    }
    if (datagrams == 0) continue;
    frame[0] = static_cast<std::uint8_t>(datagrams - 1);
    samples::AppendBytes(out, frame);
  }
  return out;
}

bool Write(const std::filesystem::path& path, const Bytes& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) std::fprintf(stderr, "cannot write %s\n", path.c_str());
  return !file.fail();
}

}  // namespace
}  // namespace ecaudit::fuzz

int main(int argc, char** argv) {
  using namespace ecaudit::fuzz;
  if (argc != 2) {
    std::fprintf(stderr, "usage: ecaudit_make_fuzz_seeds CORPUS_DIR\n");
    return 2;
  }
  const std::filesystem::path root = argv[1];
  Story preop;
  ToPreop(preop);
  Story running;
  Run(running);
  bool good = Write(root / "fuzz_analysis" / "preop.pcapng", preop.capture.Encode());
  good = Write(root / "fuzz_analysis" / "running.pcapng.gz", Gzip(running.capture.Encode())) && good;
  running.capture.style.format = ecaudit::samples::FileFormat::kPcapMicro;
  good = Write(root / "fuzz_analysis" / "running.pcap", running.capture.Encode()) && good;
  good = Write(root / "fuzz_bus" / "preop", Compact(preop, preop.capture.recorded())) && good;
  good = Write(root / "fuzz_bus" / "running", Compact(running, running.capture.recorded())) && good;
  return good ? 0 : 1;
}
