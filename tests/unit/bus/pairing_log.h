/// Runs packets through DirectionLearner and Pairing and writes down what comes out, one word a call.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "decoder/bus/pairing.h"
#include "decoder/bus/traffic_reader.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::bus::test {

using ecaudit::test::Packet;
using ecaudit::test::Trace;
using samples::Bytes;

[[nodiscard]] inline std::string_view NameOf(GapBefore gap) {
  switch (gap) {
    case GapBefore::kNone:
      break;
    case GapBefore::kRounds:
      return "rounds";
    case GapBefore::kPossible:
      return "silence";
    case GapBefore::kSkip:
      return "skip";
    case GapBefore::kLikelySkip:
      return "likely skip";
    case GapBefore::kCertain:
      return "hole";
  }
  return "none";
}

/// What left Pairing:
///   "1+2"    frame 1 came back as frame 2           "+2"     a return without its outbound copy
///   "1?"     taken as done, returns are not captured
///   "lost 1" (overtaken), "silent 1", "undecided 1" "dup 3 of 2"
///   "altered 4", "malformed 4", "foreign malformed 4"
class PairingLog final : public BusSink {
 public:
  void OnFrame(const wire::FrameView& frame, Direction direction) override {
    directions.resize(static_cast<std::size_t>(frame.ref().number), '.');
    directions.back() = direction == Direction::kOutbound   ? 'o'
                        : direction == Direction::kReturned ? 'r'
                        : direction == Direction::kForeign  ? 'f'
                                                            : '?';
  }
  void OnSent(const wire::FrameView& frame) override { sent.push_back(frame.ref().number); }
  void OnTransaction(const BusTransaction& t) override {
    const std::string from = t.sent != nullptr ? std::to_string(t.sent->ref().number) : "";
    const std::string to = t.returned != nullptr ? "+" + std::to_string(t.returned->ref().number) : "";
    words.push_back(from + to + (t.assumed ? "?" : ""));
    if (t.gap != GapBefore::kNone) {
      gaps.push_back(std::string(NameOf(t.gap)) + ' ' + from + to + (t.gap_at_return ? " at return" : ""));
    }
  }
  void OnDoubtful(const wire::FrameView& frame) override {
    doubtful.push_back(frame.ref().number);
    before_doubt.push_back(words.empty() ? "" : words.back());
  }
  void OnLost(const wire::FrameView& frame, Loss loss, bool followed_by_other) override {
    const char* how = loss == Loss::kOvertaken ? "lost " : loss == Loss::kSilence ? "silent " : "undecided ";
    words.push_back(how + std::to_string(frame.ref().number) + (followed_by_other ? "!" : ""));
  }
  void OnDuplicate(const wire::FrameView& frame, FrameNo original) override {
    words.push_back("dup " + std::to_string(frame.ref().number) + " of " + std::to_string(original));
  }
  void OnRepeated(const RepeatedFrame& r) override {
    repeats.push_back(std::to_string(r.before.number) + "+" + std::to_string(r.returned.number) +
                      (r.answered() ? " again " : " late after ") + std::to_string(r.again.number) +
                      (r.may_miss_round_of > 0 ? " or gap" : "") + (r.brought_news ? " news" : ""));
  }
  void OnUnusable(const wire::FrameView& frame, Unusable reason, bool own_master) override {
    words.push_back((own_master ? "" : "foreign ") +
                    std::string(reason == Unusable::kAltered ? "altered " : "malformed ") +
                    std::to_string(frame.ref().number));
  }

  std::vector<std::string> words;
  std::vector<std::string> gaps;  ///< "hole 5+6": frames are missing before frame 5; skip, rounds, silence: perhaps;
                                  ///< "at return": before its return
  /// "5+6 again 7": frame 7 is frame 5 once more, which had come back as 6; "5+8 late after 7": it came back then.
  std::vector<std::string> repeats;
  std::vector<FrameNo> sent;
  std::vector<FrameNo> doubtful;
  std::vector<std::string> before_doubt;  ///< the word before each of them
  std::string directions;  ///< one character a packet: o, r, f, '?', or '.' for what is no EtherCAT frame

  /// Words that begin with `prefix`.
  [[nodiscard]] std::vector<std::string> Only(std::string_view prefix) const {
    std::vector<std::string> out;
    for (const std::string& word : words) {
      if (std::string_view(word).starts_with(prefix)) out.push_back(word);
    }
    return out;
  }
};

struct Paired {
  PairingLog log;
  PairingStatistics statistics;
  bool outbound_only = false;
  bool returned_only = false;
};

/// @param window packets that the learner sees first (the pipeline: 256 EtherCAT frames)
inline Paired PairUp(const std::vector<Packet>& packets, std::size_t window = 256) {
  Paired out;
  DirectionLearner directions;
  ecaudit::test::MemorySource first(packets);
  capture::CapturedFrame frame;
  for (std::size_t i = 0; i < window && first.Next(frame) == capture::ReadStatus::kFrame; ++i) {
    directions.Learn(wire::FrameView::Parse(frame));
  }
  directions.Finish();
  Pairing pairing(directions, out.log);
  ecaudit::test::MemorySource again(packets);
  while (again.Next(frame) == capture::ReadStatus::kFrame) pairing.Push(wire::FrameView::Parse(frame));
  pairing.Finish();
  out.statistics = pairing.statistics();
  out.outbound_only = directions.outbound_only();
  out.returned_only = directions.returned_only();
  return out;
}

inline Paired PairUp(const Trace& trace, std::size_t window = 256) {
  return PairUp(trace.Packets(), window);
}

inline Paired PairUp(std::string_view text, std::size_t window = 256) {
  Result<Trace> trace = Trace::Parse(text);
  EXPECT_TRUE(trace.has_value()) << (trace ? "" : trace.error().message);
  return trace ? PairUp(*trace, window) : Paired{};
}

/// As the reader leaves it: what is set aside before packets are paired as well.
inline PairingStatistics StatisticsOf(const std::vector<Packet>& packets, const capture::CaptureInfo& info = {}) {
  ecaudit::test::MemorySource source(packets, info);
  constexpr PacketRange kAll;
  PairingLog log;
  TrafficReader reader(source, kAll, nullptr, log);
  for (auto got = reader.Next(); got != TrafficReader::Got::kEnd; got = reader.Next()) {
    if (got == TrafficReader::Got::kPacket) reader.Pair();
  }
  reader.Finish();
  return reader.statistics();
}

/// Packet `from` again, at the end, `ns` after the last one.
inline void Append(std::vector<Packet>& packets, const Packet& from, TimeNs ns = 1000) {
  Packet copy = from;
  copy.time = packets.empty() ? from.time : packets.back().time + ns;
  packets.push_back(std::move(copy));
}

}  // namespace ecaudit::bus::test
