/// Runs a trace through the decoder and writes down the events, one line each, as a reviewer would tell them.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/wiring/event_bus.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::track::test {

using ecaudit::test::MemorySource;
using ecaudit::test::Packet;
using ecaudit::test::Trace;
using samples::Bytes;

inline const char* Name(Acceptance acceptance) {
  switch (acceptance) {
    case Acceptance::kAccepted:
      return "accepted";
    case Acceptance::kRefused:
      return "refused";
    case Acceptance::kUnknown:
      return "unknown";
    case Acceptance::kAssumed:
      return "assumed";
  }
  return "?";
}

/// "found 0", "address 0 = 0x1001", "address 1 = 0x1001 as 0", "count 3", "count 3 -> 2", "sent 0 <- 0x0002",
/// "request 0 <- 0x0002 accepted", "state 0 0x0001 -> 0x0002", "code 0 0x0017", "forgotten 0",
/// "repeat 0 requested", "logical LRW 0x00001000 wkc 3", "lost 5", "hole 5", "skip 5", "silence 5", "run 5 (clock)",
/// "run 5 (set up)".
class EventLog final : public EventBus {
 public:
  EventLog() {
    ListenTo<SlaveFound, AddressAssigned, SlaveCount, AlRequest, AlStatusRead, AlStatusCodeRead, AlStateForgotten,
             RunBegan, CaptureGap, LogicalAccess, Answered, FrameLost, SlaveAccess, AlRequestSent,
             mailbox::MailboxRepeatRequest>(Stage::kModel, *this);
  }

  void On(const SlaveFound& e) { Say("found " + Id(e.slave)); }
  void On(const AddressAssigned& e) {
    Say("address " + Id(e.slave) + " = " + Hex(e.address) +
        (e.duplicate_of != kNoSlave ? " as " + Id(e.duplicate_of) : ""));
  }
  void On(const SlaveCount& e) {
    Say("count " + (e.first ? "" : std::to_string(e.previous) + " -> ") + std::to_string(e.count));
  }
  void On(const AlRequest& e) {
    Say("request " + Id(e.slave) + " <- " + Hex(e.control.raw) + " " + Name(e.acceptance));
  }
  void On(const AlStatusRead& e) {
    reads.push_back(e);
    if (!e.changed()) return;
    Say("state " + Id(e.slave) + " " + (e.before ? Hex(e.before->raw) : "?") + " -> " + Hex(e.status.raw) +
        (e.status_code ? " code " + Hex(*e.status_code) : "") + (e.error_bit_known ? "" : " (error bit of somebody)"));
  }
  void On(const mailbox::MailboxRepeatRequest& e) {
    const bool asked = e.kind == mailbox::MailboxRepeatRequest::Kind::kRequested;
    Say("repeat " + Id(e.slave) + (asked ? " requested" : " acknowledged"));
  }
  void On(const AlStatusCodeRead& e) { Say("code " + Id(e.slave) + " " + Hex(e.code)); }
  void On(const AlStateForgotten& e) { Say("forgotten " + Id(e.slave)); }
  void On(const RunBegan& e) {
    Say("run " + std::to_string(e.frame.number) + (e.reason == RunBegan::Reason::kClock ? " (clock)" : " (set up)"));
  }
  void On(const CaptureGap& e) {
    Say((e.certain ? "hole " : e.skip ? "skip " : "silence ") + std::to_string(e.frame.number));
  }
  void On(const LogicalAccess& e) {
    Say("logical " + std::string(wire::Name(e.command)) + " " + Hex(e.address, 8) + " wkc " + std::to_string(e.wkc) +
        (e.assumed ? " assumed" : ""));
  }
  void On(const Answered& e) { answers.push_back(e); }
  void On(const FrameLost& e) { Say("lost " + std::to_string(e.sent.ref().number)); }
  void On(const SlaveAccess& e) {
    accesses.push_back({e.slave, e.address, e.acceptance, Bytes(e.written.begin(), e.written.end()),
                        Bytes(e.read.begin(), e.read.end()), e.command, e.broadcast});
  }
  void On(const AlRequestSent& e) { Say("sent " + Id(e.slave) + " <- " + Hex(e.control.raw)); }

  struct Access {
    SlaveId slave;
    EscAddress address;
    Acceptance acceptance;
    Bytes written;
    Bytes read;
    wire::Command command;
    bool broadcast;
  };
  std::vector<std::string> lines;
  std::vector<Access> accesses;
  std::vector<AlStatusRead> reads;
  std::vector<Answered> answers;  ///< their spans are gone

  [[nodiscard]] std::vector<std::string> Only(std::string_view prefix) const {
    std::vector<std::string> out;
    for (const std::string& line : lines) {
      if (std::string_view(line).starts_with(prefix)) out.push_back(line);
    }
    return out;
  }

 private:
  static std::string Id(SlaveId id) { return id == kNoSlave ? "nobody" : std::to_string(id); }
  void Say(std::string line) { lines.push_back(std::move(line)); }
};

/// A decoder that has read everything.
struct Decoded {
  std::unique_ptr<EventLog> log = std::make_unique<EventLog>();
  std::unique_ptr<Pipeline> pipeline;

  [[nodiscard]] const Network& network() const { return pipeline->network(); }
  [[nodiscard]] const bus::SlaveSet& slaves() const { return network().slaves(); }
  /// Register value where it was observed, else where it was inferred; "?" when unknown.
  [[nodiscard]] std::string Register(SlaveId slave, EscAddress address) const {
    const esc::RegisterImage& registers = network().state(slave).registers;
    if (const auto value = registers.Value<std::uint16_t>(address, Certainty::kObserved)) return Hex(*value);
    if (const auto value = registers.Value<std::uint16_t>(address)) return Hex(*value) + "?";
    return "?";
  }
};

inline Decoded Decode(std::vector<Packet> packets) {
  Decoded out;
  out.pipeline = std::make_unique<Pipeline>(*out.log);
  MemorySource source(std::move(packets));
  out.pipeline->Run(source);
  return out;
}

inline Decoded Decode(const Trace& trace) {
  return Decode(trace.Packets());
}

inline Decoded Decode(std::string_view text) {
  Result<Trace> trace = Trace::Parse(text);
  EXPECT_TRUE(trace.has_value()) << (trace ? "" : trace.error().message);
  return Decode(trace ? trace->Packets() : std::vector<Packet>{});
}

}  // namespace ecaudit::track::test
