// Where the time goes, stage by stage, over one capture in memory. "time" is that of the whole capture; the column
// ns_a_frame is the one to compare. Stages contain those above them: the difference is what a stage costs.
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>

#include <benchmark/benchmark.h>
#include <pcap/pcap.h>

#include "analyzers/analysis.h"
#include "decoder/capture/capture_stream.h"
#include "decoder/pipeline.h"
#include "tests/perf/long_run.h"

namespace ecaudit::perf {
namespace {

constexpr std::uint64_t kFrames = 100'000;

/// Arguments of a benchmark: slaves, and 1 for pcapng.
const samples::Bytes& Capture(const benchmark::State& state) {
  static std::map<std::pair<std::int64_t, std::int64_t>, samples::Bytes> made;
  const std::pair key(state.range(0), state.range(1));
  const auto [place, is_new] = made.try_emplace(key);
  if (is_new) {
    LongRun run;
    run.slaves = static_cast<std::size_t>(state.range(0));
    run.frames = kFrames;
    run.format = state.range(1) != 0 ? samples::FileFormat::kPcapNg : samples::FileFormat::kPcapNano;
    place->second = MakeLongRun(run);
  }
  return place->second;
}

std::unique_ptr<capture::FrameSource> Open(const samples::Bytes& file) {
  auto source = capture::OpenCaptureFromMemory(file);
  if (!source) std::abort();
  return std::move(*source);
}

void Report(benchmark::State& state, std::uint64_t frames) {
  state.SetItemsProcessed(static_cast<std::int64_t>(frames) * state.iterations());
  state.counters["ns_a_frame"] =
      benchmark::Counter(static_cast<double>(frames) * static_cast<double>(state.iterations()) / 1e9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

/// The yardstick: libpcap's own loop.
void LibpcapLoop(benchmark::State& state) {
  const samples::Bytes& file = Capture(state);
  std::uint64_t frames = 0;
  for (auto _ : state) {
    char problem[PCAP_ERRBUF_SIZE] = "";
    pcap_t* pcap = pcap_fopen_offline(fmemopen(const_cast<std::uint8_t*>(file.data()), file.size(), "rb"), problem);
    if (pcap == nullptr) std::abort();
    pcap_pkthdr* header = nullptr;
    const u_char* bytes = nullptr;
    frames = 0;
    while (pcap_next_ex(pcap, &header, &bytes) == 1) ++frames;
    pcap_close(pcap);
  }
  Report(state, frames);
}

void ReadFrames(benchmark::State& state) {
  const samples::Bytes& file = Capture(state);
  std::uint64_t frames = 0;
  for (auto _ : state) {
    const auto source = Open(file);
    capture::CapturedFrame frame;
    frames = 0;
    while (source->Next(frame) == capture::ReadStatus::kFrame) ++frames;
  }
  Report(state, frames);
}

void CutIntoDatagrams(benchmark::State& state) {
  const samples::Bytes& file = Capture(state);
  std::uint64_t frames = 0;
  for (auto _ : state) {
    const auto source = Open(file);
    capture::CapturedFrame frame;
    frames = 0;
    while (source->Next(frame) == capture::ReadStatus::kFrame) {
      const wire::FrameView view = wire::FrameView::Parse(frame);
      benchmark::DoNotOptimize(view.size());
      ++frames;
    }
  }
  Report(state, frames);
}

/// Up to the events of the decoder: pairing and tracking.
void TrackEvents(benchmark::State& state) {
  const samples::Bytes& file = Capture(state);
  std::uint64_t frames = 0;
  for (auto _ : state) {
    const auto source = Open(file);
    EventSink nobody;
    Pipeline pipeline(nobody);
    pipeline.Run(*source);
    frames = pipeline.statistics().packets;
  }
  Report(state, frames);
}

/// Everything: slave models and all rules.
void AnalyseAll(benchmark::State& state) {
  const samples::Bytes& file = Capture(state);
  std::uint64_t frames = 0;
  for (auto _ : state) {
    const auto source = Open(file);
    const AnalysisResult result = Analyse(*source, {});
    frames = result.capture.packets;
    if (!result.findings.empty()) state.SkipWithError("the capture is healthy, but there are findings");
  }
  Report(state, frames);
}

void Captures(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"slaves", "pcapng"})->Unit(benchmark::kMillisecond);
  for (const std::int64_t slaves : {1, 3, 20}) benchmark->Args({slaves, 1});
  benchmark->Args({3, 0});
}

BENCHMARK(LibpcapLoop)->Apply(Captures);
BENCHMARK(ReadFrames)->Apply(Captures);
BENCHMARK(CutIntoDatagrams)->Apply(Captures);
BENCHMARK(TrackEvents)->Apply(Captures);
BENCHMARK(AnalyseAll)->Apply(Captures);

}  // namespace
}  // namespace ecaudit::perf

BENCHMARK_MAIN();
