/// Results made by hand, for the tests of the writers.
#pragma once

#include <string>
#include <string_view>

#include "cli/report/report.h"
#include "tests/support/findings.h"
#include "tests/support/reasons.h"

namespace ecaudit::test {

/// 2019-05-01 12:00:00 UTC.
inline constexpr TimeNs kStart = 1'556'712'000'000'000'000;

/// A packet stamped 1 ms times its number after the start; number 1 is the first packet, at the start.
inline FrameRef Frame(FrameNo number) {
  return {number, kStart + (static_cast<TimeNs>(number) - 1) * 1'000'000, true};
}

inline Finding MakeFinding(std::string_view rule, Severity severity, SlaveId slave, FrameNo frame,
                           FindingIndex caused_by = kNoFinding) {
  Finding finding;
  finding.rule = rule;
  finding.severity = severity;
  SetTexts(finding, "title of " + std::string(rule), "message of " + std::string(rule), "any");
  finding.slave = slave;
  finding.first = Frame(frame);
  finding.last = finding.first;
  finding.caused_by = caused_by;
  return finding;
}

inline AlStep MakeStep(AlStep::Kind kind, FrameNo frame, std::uint16_t from, std::uint16_t to) {
  AlStep step;
  step.kind = kind;
  step.frame = Frame(frame);
  step.from = from;
  step.to = to;
  return step;
}

inline SlaveSummary MakeSlave(SlaveId id, SlavePos position, StationAddress address, std::string name) {
  SlaveSummary slave;
  slave.id = id;
  slave.position = position;
  slave.station_address = address;
  slave.name = std::move(name);
  slave.profile = "generic";
  slave.profile_source = "default";
  return slave;
}

/// One AKD that refused SAFEOP, as in the contract's example: 6762 packets, both directions.
inline report::CaptureReport RefusedSafeop() {
  report::CaptureReport report;
  AnalysisResult& r = report.result;
  r.capture.file.path = "akd.pcapng";
  r.capture.file.format = "pcapng";
  r.capture.packets = 6762;
  r.capture.ethercat_frames = 6759;
  r.capture.datagrams = 6800;
  r.capture.outbound_frames = 3380;
  r.capture.returned_frames = 3379;
  r.capture.other_packets = 3;
  r.capture.origin = r.capture.first = Frame(1);
  r.capture.last = Frame(6762);
  r.capture.duration_ns = 6'761'000'000;
  r.capture.direction = DirectionSeen::kBoth;
  r.capture.timestamps.resolution_ns = 1000;
  r.bus.slave_count = 1;

  SlaveSummary slave = MakeSlave(7, 0, 0x1001, "AKD");  // an id that differs from the position
  slave.identity.vendor_id = 0x6A;
  slave.identity.product_code = 0x00414B44;
  slave.identity.revision = 2;
  slave.profile = "kollmorgen-akd-2011";
  slave.profile_source = "EEPROM identity";
  slave.al_status = 0x12;
  slave.al_status_code = 0x1D;
  slave.al_history = {MakeStep(AlStep::Kind::kState, 400, 0x01, 0x02),
                      MakeStep(AlStep::Kind::kRequest, 743, 0x02, 0x04),
                      MakeStep(AlStep::Kind::kState, 760, 0x02, 0x12)};
  slave.al_history[2].status_code = 0x1D;
  r.slaves.push_back(slave);

  Finding finding = MakeFinding("al-refused", Severity::kError, 7, 760);
  SetTexts(finding, "SAFEOP refused with AL status code 0x001d",
           "The slave stayed in PREOP. Check the output sync manager");
  finding.last = Frame(6762);
  finding.count = 5999;
  finding.related_frames = {743};
  finding.Set("al_status_code", arg::Hex(0x1D))
      .Set("polls", arg::Number(5999))
      .Set("mean_ms", arg::Ms(1'500'000))
      .Set("requested", arg::State(4));
  finding.reference = {"AKD EtherCAT Communication", "4.3"};
  r.findings.push_back(finding);
  r.not_evaluable.push_back({"sync-lost", 7, Because("DC"), 0, 1});
  r.not_evaluable.push_back({"frame-lost", kNoSlave, Because("the end"), 6000, 2});
  return report;
}

inline report::Report OneReport(report::CaptureReport capture) {
  report::Report report;
  report.version = "1.2.3";
  report.captures.push_back(std::move(capture));
  return report;
}

}  // namespace ecaudit::test
