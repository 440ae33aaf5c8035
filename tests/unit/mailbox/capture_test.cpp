/// Whole captures through the decoder, compared with what their truth files and Wireshark say.
#include <algorithm>
#include <deque>
#include <filesystem>
#include <fstream>
#include <memory>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "analyzers/wiring/event_bus.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/pipeline.h"
#include "decoder/track/mailbox_tracker.h"
#include "tests/support/folders.h"
#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

using nlohmann::json;

std::string CapturePath(const std::string& name) {
  return test::SharedDir() + "/captures/" + name;
}

/// Feeds one MailboxTracker a slave from a capture's accesses, as the pipeline's owner does.
class MailboxRun final : public EventBus {
 public:
  explicit MailboxRun(const std::string& path) {
    ListenTo<track::SlaveAccess, track::FrameLost, MailboxMessage, SdoTransfer>(Stage::kModel, *this);
    Result<std::unique_ptr<capture::FrameSource>> source = capture::OpenCapture(path);
    if (!source.has_value()) return;
    Pipeline pipeline(*this);
    pipeline_ = &pipeline;
    pipeline.Run(**source);
    for (track::MailboxTracker& tracker : trackers_) tracker.Finish();
    pipeline_ = nullptr;
    ran = true;
  }

  void On(const track::SlaveAccess& access) {
    const bool lost_read = access.acceptance == track::Acceptance::kUnknown && access.written.empty();
    if (lost_read && !feeding_lost_ && access.sent.number == lost_frame_) return;  // fed already
    while (trackers_.size() <= access.slave) {
      trackers_.emplace_back(static_cast<SlaveId>(trackers_.size()), events);
      versions_.push_back(0);
    }
    const track::SlaveState& state = pipeline_->network().state(access.slave);
    if (state.mapping_version != versions_[access.slave]) {
      versions_[access.slave] = state.mapping_version;
      trackers_[access.slave].SetWindow(track::MailboxWindowOf(state), access.frame());
    }
    trackers_[access.slave].OnAccess(access);
  }

  /// Reads whose frame never returned.
  void On(const track::FrameLost& lost) {
    lost_frame_ = lost.sent.ref().number;
    feeding_lost_ = true;
    for (std::size_t i = 0; i < lost.sent.size(); ++i) {
      const wire::DatagramView d = lost.sent[i];
      if (!wire::IsNodeAddressed(d.command()) || wire::Writes(d.command()) || !wire::Reads(d.command())) continue;
      track::SlaveAccess access;
      access.slave = pipeline_->network().slaves().AtStation(d.adp());
      if (access.slave == kNoSlave) continue;
      access.sent = lost.sent.ref();
      access.command = d.command();
      access.address = d.ado();
      On(access);
    }
    feeding_lost_ = false;
  }
  void On(const MailboxMessage&) { ++network_messages; }
  void On(const SdoTransfer& transfer) { network_transfers.emplace_back(transfer); }

  const track::MailboxCounters& counters(SlaveId slave) { return trackers_.at(slave).counters(); }

  bool ran = false;
  Recorder events;
  /// What the network's own trackers report.
  std::size_t network_messages = 0;
  std::vector<KeptTransfer> network_transfers;

 private:
  Pipeline* pipeline_ = nullptr;
  std::deque<track::MailboxTracker> trackers_;
  std::vector<std::uint32_t> versions_;
  FrameNo lost_frame_ = 0;
  bool feeding_lost_ = false;
};

json ReadTruth(const std::string& name) {
  std::ifstream file(CapturePath(name + ".truth.json"));
  return json::parse(file, nullptr, false);
}

std::uint64_t Number(const json& value) {
  return value.is_string() ? std::stoull(value.get<std::string>(), nullptr, 0) : value.get<std::uint64_t>();
}

#define REQUIRE_CAPTURES() \
  if (!std::filesystem::exists(CapturePath("lab"))) GTEST_SKIP() << "captures not beside the project"

class LabMessages : public ::testing::TestWithParam<const char*> {};

/// Every mailbox message on the wire, in order, field by field as the truth files list them.
TEST_P(LabMessages, AreAllFound) {
  REQUIRE_CAPTURES();
  const std::string name = std::string("lab/") + GetParam();
  const json truth = ReadTruth(name);
  ASSERT_TRUE(truth.contains("mailbox_messages_on_wire"));
  MailboxRun run(CapturePath(name + ".pcapng"));
  ASSERT_TRUE(run.ran);
  const json& expected = truth["mailbox_messages_on_wire"];
  std::vector<KeptMessage> found = run.events.messages;
  std::stable_sort(found.begin(), found.end(),
                   [](const KeptMessage& a, const KeptMessage& b) { return a.frame().number < b.frame().number; });
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    const KeptMessage& m = found[i];
    const json& e = expected[i];
    SCOPED_TRACE(e.dump());
    EXPECT_EQ(m.frame().number, Number(e["packet"]));
    EXPECT_EQ(m.direction == Direction::kOut, e["dir"] == "master->slave");
    EXPECT_EQ(m.header.length, Number(e["mbx_len"]));
    EXPECT_EQ(m.header.counter, Number(e["cnt"]));
    EXPECT_EQ(static_cast<unsigned>(m.header.protocol), Number(e["type"]));
    EXPECT_EQ(m.problem, Problem::kNone);
    EXPECT_EQ(m.certainty, Certainty::kObserved);
    EXPECT_FALSE(m.repeated);
    EXPECT_FALSE(m.window_inferred);
    EXPECT_EQ(m.bytes.size(), m.header.length);
    if (!e.contains("coe_service")) continue;
    EXPECT_EQ(static_cast<unsigned>(ParseCoeHeader(m.bytes).service), Number(e["coe_service"]));
    if (e.contains("cmd_byte")) {
      EXPECT_EQ(m.bytes[2], Number(e["cmd_byte"]));
    }
    if (e.contains("info_opcode")) {
      EXPECT_EQ(m.bytes[2] & 0x7F, static_cast<int>(Number(e["info_opcode"])));
      EXPECT_EQ(m.bytes[2] >> 7, static_cast<int>(Number(e["info_incomplete"])));
      EXPECT_EQ(LittleEndian<std::uint16_t>(m.bytes, 4), Number(e["fragments_left"]));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Captures, LabMessages,
                         ::testing::Values("bad-sm-config", "dc", "disturbed-returns", "drive-fault", "foe-unsupported",
                                           "illegal-init-to-op", "jitter", "kickcat-ingenia-info", "latch",
                                           "legal-shortcuts", "lost-frames", "mailbox-emergency", "mailbox-error-reply",
                                           "mailbox-read-reply-lost", "mailbox-timeout", "mid-run", "mixed-traffic",
                                           "no-ack-after-error", "one-slave-refuses", "sdo-mix", "soem-ec-sample",
                                           "soem-slaveinfo-akd", "soem-slaveinfo-akdca", "startup-ok-1slave",
                                           "startup-ok-1slave-cooked", "startup-ok-1slave-pdo1701",
                                           "startup-ok-3slaves", "watchdog-sm", "wkc-error-link-break"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

/// All SDO transfers of sdo-mix with their bytes, in the order in which the master made them.
TEST(LabTransfers, SdoMix) {
  REQUIRE_CAPTURES();
  const json truth = ReadTruth("lab/sdo-mix");
  MailboxRun run(CapturePath("lab/sdo-mix.pcapng"));
  ASSERT_TRUE(run.ran);
  std::vector<json> expected;
  std::vector<json> expected_infos;
  for (const json& e : truth["sdo"]) {
    (e["ev"] == "sdo_read" || e["ev"] == "sdo_write" ? expected : expected_infos).push_back(e);
  }
  const auto& found = run.events.transfers;
  ASSERT_EQ(found.size(), expected.size());
  std::size_t aborts = 0;
  std::map<std::uint64_t, std::uint64_t> abort_codes;  // by packet, as Wireshark shows them
  for (const json& a : truth["capture_check"]["sdo_aborts_per_tshark"]) {
    abort_codes[Number(a["packet"])] = Number(a["abort"]);
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    const KeptTransfer& t = found[i];
    const json& e = expected[i];
    SCOPED_TRACE(e.dump());
    const bool read = e["ev"] == "sdo_read";
    EXPECT_EQ(t.service, read ? SdoService::kUpload : SdoService::kDownload);
    EXPECT_EQ(t.index, Number(e["index"]));
    EXPECT_EQ(t.complete_access, Number(e["ca"]) != 0);
    if (e["note"] == "CA with subindex 2 (SOEM rewrites to 1)") {
      EXPECT_EQ(t.subindex, 1);
    } else {
      EXPECT_EQ(t.subindex, Number(e["sub"]));
    }
    EXPECT_EQ(t.outcome == SdoOutcome::kCompleted, e["ok"].get<bool>());
    EXPECT_EQ(t.certainty, Certainty::kObserved);
    EXPECT_TRUE(t.duration.has_value() && *t.duration > 0);
    EXPECT_FALSE(t.response_service_mismatch);
    EXPECT_EQ(t.toggle_errors, 0U);
    EXPECT_FALSE(t.size_mismatch);
    if (t.outcome == SdoOutcome::kAborted) {
      ++aborts;
      EXPECT_EQ(t.aborted_by, Direction::kIn);
      ASSERT_TRUE(abort_codes.contains(t.response.number));
      EXPECT_EQ(t.abort_code, abort_codes[t.response.number]);
      if (e.contains("abort")) {
        EXPECT_EQ(t.abort_code, Number(e["abort"]));
      }
      EXPECT_EQ(t.displaced_abort_code.has_value(), t.response.number == 588);
    } else if (read && e["note"] != "CA with subindex 2 (SOEM rewrites to 1)") {
      EXPECT_EQ(t.size, Number(e["size"]));
      const std::size_t shown = std::min<std::size_t>(32, t.bytes.size());
      EXPECT_EQ(Bytes(t.bytes.begin(), t.bytes.begin() + static_cast<std::ptrdiff_t>(shown)),
                FromHex(e["data_hex_first32"].get<std::string>()));
    }
    if (!read) {
      EXPECT_EQ(t.size, Number(e["size"]));
      Bytes start = t.bytes;
      start.resize(4);
      EXPECT_EQ(LittleEndian<std::uint32_t>(start, 0), Number(e["value_le32"]));
    }
    const SdoTransferKind kind = t.size <= 4 && !t.complete_access ? SdoTransferKind::kExpedited
                                 : t.size <= 1008                  ? SdoTransferKind::kNormal
                                                                   : SdoTransferKind::kSegmented;
    if (t.outcome == SdoOutcome::kCompleted) {
      EXPECT_EQ(t.kind, kind);
    }
  }
  EXPECT_EQ(aborts, 11U);
  EXPECT_TRUE(run.events.unexpected.empty());
  EXPECT_TRUE(run.events.unanswered.empty());
  EXPECT_EQ(run.counters(0).sdo_aborts, 11U);

  // The block of 2500 bytes that was written is what was read back.
  const auto block = std::find_if(found.begin(), found.end(), [](const KeptTransfer& t) {
    return t.service == SdoService::kDownload && t.size == 2500;
  });
  const auto back = std::find_if(
      block, found.end(), [](const KeptTransfer& t) { return t.service == SdoService::kUpload && t.size == 2500; });
  ASSERT_NE(back, found.end());
  EXPECT_EQ(block->bytes, back->bytes);
  EXPECT_EQ(Text(block->bytes).substr(0, 27), "ABCDEFGHIJKLMNOPQRSTUVWXYZA");

  // SDO information: the list, then object and entry descriptions, an error for 5FFFh at the end.
  std::size_t info = 0;
  for (const json& e : expected_infos) {
    SCOPED_TRACE(e.dump());
    const std::size_t count = e["ev"] == "sdo_info_oe" ? Number(e["entries"]) : 1;
    for (std::size_t k = 0; k < count; ++k, ++info) {
      ASSERT_LT(info, run.events.infos.size());
      const KeptInfo& i = run.events.infos[info];
      EXPECT_EQ(i.outcome == SdoInfo::Outcome::kCompleted, e["ok"].get<bool>());
      EXPECT_FALSE(i.fragment_error);
      // KickCAT's error answer has a length of 6, which leaves its own error code out.
      EXPECT_EQ(i.malformed, !e["ok"].get<bool>());
      EXPECT_TRUE(i.request.seen());
      if (e["ev"] == "sdo_info_odlist") {
        EXPECT_EQ(i.kind, SdoInfo::Kind::kList);
        EXPECT_EQ(i.objects.size(), Number(e["entries"]));
        EXPECT_EQ(i.objects.front(), 0x1000);
        continue;
      }
      EXPECT_EQ(i.index, Number(e["index"]));
      if (e["ev"] == "sdo_info_oe") {
        EXPECT_EQ(i.kind, SdoInfo::Kind::kEntry);
        EXPECT_EQ(i.subindex, k);
      } else if (e["ok"].get<bool>()) {
        EXPECT_EQ(i.kind, SdoInfo::Kind::kObject);
        EXPECT_EQ(i.max_subindex, Number(e["maxsub"]));
        EXPECT_EQ(i.object_code, Number(e["objcode"]));
        EXPECT_FALSE(i.text.empty());
      } else {
        EXPECT_EQ(i.outcome, SdoInfo::Outcome::kError);
        EXPECT_EQ(i.abort_code, Number(e["abort"]));
      }
    }
  }
  EXPECT_EQ(info, run.events.infos.size());
}

TEST(LabTransfers, MasterAndTrackerSeeTheSame) {
  REQUIRE_CAPTURES();
  for (const char* name :
       {"startup-ok-1slave", "startup-ok-3slaves", "dc", "jitter", "drive-fault", "mailbox-emergency"}) {
    SCOPED_TRACE(name);
    const json truth = ReadTruth(std::string("lab/") + name);
    MailboxRun run(CapturePath(std::string("lab/") + name + ".pcapng"));
    ASSERT_TRUE(run.ran);
    // SOEM's own configuration reads are not in the master's list: each entry must appear, in order, per slave.
    std::map<std::uint64_t, std::size_t> next;
    for (const json& e : truth["sdo"]) {
      SCOPED_TRACE(e.dump());
      const auto slave = static_cast<SlaveId>(Number(e["slave"]) - 1);
      const auto& all = run.events.transfers;
      std::size_t& at = next[slave];
      while (at < all.size() &&
             !(all[at].slave == slave && all[at].index == Number(e["index"]) && all[at].subindex == Number(e["sub"]) &&
               (all[at].service == SdoService::kUpload) == (e["ev"] == "sdo_read"))) {
        ++at;
      }
      ASSERT_LT(at, all.size());
      EXPECT_EQ(all[at].size, Number(e["size"]));
      EXPECT_EQ(all[at].outcome, SdoOutcome::kCompleted);
      ++at;
    }
    EXPECT_TRUE(run.events.unexpected.empty());
    EXPECT_TRUE(run.events.unanswered.empty());
    EXPECT_TRUE(run.events.refused.empty());
    for (const KeptTransfer& t : run.events.transfers) EXPECT_EQ(t.certainty, Certainty::kObserved);
  }
}

TEST(LabTransfers, CompleteAccess) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("lab/soem-slaveinfo-akdca.pcapng"));
  const json truth = ReadTruth("lab/soem-slaveinfo-akdca");
  std::size_t requests = 0;
  std::size_t descriptions = 0;
  for (const json& m : truth["mailbox_messages_on_wire"]) {
    if (m["dir"] == "slave->master") continue;
    ++(m["coe_service"] == 2 ? requests : descriptions);
  }
  ASSERT_EQ(run.events.transfers.size(), requests);
  ASSERT_EQ(run.events.infos.size(), descriptions);
  std::map<std::uint64_t, std::uint64_t> aborts;
  for (const json& a : truth["capture_check"]["sdo_aborts_per_tshark"])
    aborts[Number(a["packet"])] = Number(a["abort"]);
  std::size_t complete = 0;
  for (const KeptTransfer& t : run.events.transfers) {
    complete += t.complete_access ? 1U : 0U;
    EXPECT_EQ(t.outcome == SdoOutcome::kAborted, aborts.contains(t.response.number));
    if (t.outcome == SdoOutcome::kAborted) {
      EXPECT_EQ(t.abort_code, aborts[t.response.number]);
    }
  }
  std::size_t commands = 0;
  for (const json& m : truth["mailbox_messages_on_wire"]) commands += m.value("cmd_byte", "") == "0x50" ? 1U : 0U;
  EXPECT_EQ(complete, commands);
  EXPECT_GT(complete, 0U);
}

TEST(LabTransfers, Emergencies) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("lab/mailbox-emergency.pcapng"));
  // Two were injected; the second found the mailbox full (rc=-11 in the truth) and never reached the wire.
  const json truth = ReadTruth("lab/mailbox-emergency");
  std::vector<std::uint64_t> packets;
  for (const json& m : truth["mailbox_messages_on_wire"]) {
    if (m.contains("coe_service") && m["coe_service"] == 1) packets.push_back(Number(m["packet"]));
  }
  ASSERT_EQ(run.events.emergencies.size(), packets.size());
  ASSERT_FALSE(packets.empty());
  const Emergency& first = run.events.emergencies[0];
  EXPECT_EQ(first.frame.number, packets[0]);
  EXPECT_EQ(first.data.error_code, 0x7305);
  EXPECT_EQ(first.data.error_register, 0x01);
  EXPECT_EQ(first.data.data, (std::array<std::uint8_t, 5>{0x11, 0x22, 0x33, 0x44, 0x55}));
  EXPECT_EQ(run.counters(0).emergencies, packets.size());
  EXPECT_TRUE(run.events.unexpected.empty());
}

TEST(LabTransfers, MailboxErrorReplies) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("lab/mailbox-error-reply.pcapng"));
  ASSERT_EQ(run.events.errors.size(), 2U);
  for (const MailboxErrorReply& error : run.events.errors) {
    EXPECT_EQ(error.type, 1);
    EXPECT_EQ(error.detail, 7);
    EXPECT_EQ(error.request.protocol, Protocol::kCoE);
    EXPECT_EQ(error.request.index, 0x1000);
    EXPECT_EQ(error.request.subindex, 0);
  }
  EXPECT_EQ(run.events.errors[0].frame.number, 288U);
  EXPECT_EQ(run.events.errors[0].request.frame.number, 283U);
  EXPECT_EQ(run.events.errors[1].frame.number, 4628U);
  EXPECT_EQ(run.events.errors[1].request.frame.number, 4623U);
  // The upload of 2FF0h was announced and never continued; the two others were answered with the error.
  ASSERT_EQ(run.events.transfers.size(), 3U);
  EXPECT_EQ(run.events.transfers[0].index, 0x2FF0);
  EXPECT_EQ(run.events.transfers[0].outcome, SdoOutcome::kSuperseded);
  EXPECT_EQ(run.events.transfers[0].declared_size, 1400U);
  EXPECT_EQ(run.events.transfers[1].outcome, SdoOutcome::kMailboxError);
  EXPECT_EQ(run.events.transfers[1].mailbox_error, 7);
  EXPECT_EQ(run.events.transfers[2].outcome, SdoOutcome::kMailboxError);
  EXPECT_EQ(run.counters(0).empty_reads, 2U);
  EXPECT_TRUE(run.events.unanswered.empty());
}

TEST(LabTransfers, FoeUnsupported) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("lab/foe-unsupported.pcapng"));
  ASSERT_EQ(run.events.errors.size(), 2U);
  EXPECT_EQ(run.events.errors[0].detail, 2);
  EXPECT_EQ(run.events.errors[0].request.protocol, Protocol::kFoE);
  EXPECT_EQ(run.events.errors[0].request.frame.number, 275U);
  ASSERT_EQ(run.events.files.size(), 2U);
  EXPECT_FALSE(run.events.files[0].write);
  EXPECT_TRUE(run.events.files[1].write);
  for (const KeptFile& file : run.events.files) {
    EXPECT_EQ(file.name, "ECATFW__");
    EXPECT_EQ(file.outcome, FoeTransfer::Outcome::kMailboxError);
    EXPECT_EQ(file.mailbox_error, 2);
    EXPECT_EQ(file.packets, 0U);
  }
  ASSERT_EQ(run.events.transfers.size(), 1U);
  EXPECT_EQ(run.events.transfers[0].outcome, SdoOutcome::kCompleted);
}

TEST(LabTransfers, TimeoutWithAFullMailbox) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("lab/mailbox-timeout.pcapng"));
  ASSERT_EQ(run.events.unanswered.size(), 1U);
  const MailboxUnanswered& u = run.events.unanswered[0];
  EXPECT_EQ(u.request.frame.number, 275U);
  EXPECT_EQ(u.request.index, 0x1018);
  EXPECT_EQ(u.request.subindex, 1);
  EXPECT_TRUE(u.not_accepted);  // SM0 stays full
  EXPECT_FALSE(u.read_lost);
  const json truth = ReadTruth("lab/mailbox-timeout");
  const auto reads = Number(truth["capture_check"]["register_accesses_outbound"]["FPRD 0x080d len 1"]);
  EXPECT_EQ(u.polls, reads - 1);  // the first of them comes before the request
  EXPECT_EQ(u.certainty, Certainty::kObserved);
  ASSERT_EQ(run.events.refused.size(), 2U);
  EXPECT_EQ(run.events.refused[0].frame().number, 4725U);
  EXPECT_EQ(run.events.refused[1].frame().number, 4869U);
  EXPECT_EQ(run.events.refused[0].header.counter, 2);
  EXPECT_EQ(run.events.refused[0].outstanding.frame.number, 275U);
  EXPECT_FALSE(run.events.refused[0].same_as_last);
  EXPECT_FALSE(run.events.refused[0].off);
  ASSERT_EQ(run.events.transfers.size(), 1U);
  EXPECT_FALSE(run.events.transfers[0].answered);
  EXPECT_TRUE(run.events.transfers[0].incomplete());
}

TEST(LabTransfers, LostMailboxReadAndRepeatRequest) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("lab/mailbox-read-reply-lost.pcapng"));
  ASSERT_EQ(run.events.lost.size(), 1U);
  EXPECT_EQ(run.events.lost[0].frame.number, 295U);
  EXPECT_EQ(run.events.lost[0].outstanding.frame.number, 291U);
  ASSERT_EQ(run.events.repeats.size(), 2U);
  EXPECT_EQ(run.events.repeats[0].kind, MailboxRepeatRequest::Kind::kRequested);
  EXPECT_EQ(run.events.repeats[0].frame.number, 298U);
  EXPECT_EQ(run.events.repeats[1].kind, MailboxRepeatRequest::Kind::kAcknowledged);
  EXPECT_EQ(run.events.repeats[1].frame.number, 301U);
  ASSERT_EQ(run.events.transfers.size(), 8U);
  for (const KeptTransfer& t : run.events.transfers) {
    EXPECT_EQ(t.outcome, t.request.number == 291 ? SdoOutcome::kSuperseded : SdoOutcome::kCompleted);
    EXPECT_EQ(t.answer_lost, t.request.number == 291);
  }
  ASSERT_EQ(run.events.unanswered.size(), 1U);
  EXPECT_TRUE(run.events.unanswered[0].read_lost);
  EXPECT_EQ(run.events.unanswered[0].request.frame.number, 291U);
  EXPECT_FALSE(run.events.unanswered[0].not_accepted);
  EXPECT_TRUE(run.events.unexpected.empty());
}

TEST(LabTransfers, KickcatSdoInformation) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("lab/kickcat-ingenia-info.pcapng"));
  ASSERT_EQ(run.events.infos.size(), 5U);
  const KeptInfo& list = run.events.infos[0];
  EXPECT_EQ(list.kind, SdoInfo::Kind::kList);
  EXPECT_EQ(list.list_type, 1);
  EXPECT_EQ(list.fragments, 10U);
  EXPECT_FALSE(list.fragment_error);
  EXPECT_EQ(list.request.number, 1253U);
  EXPECT_EQ(list.response.number, 1294U);
  // ten messages of 122 bytes, six of them header each time, and the list type once
  EXPECT_EQ(list.objects.size(), (10U * 116U - 2U) / 2U);
  EXPECT_EQ(list.objects[0], 0x1000);
  EXPECT_EQ(list.objects[1], 0x1018);
  EXPECT_EQ(run.events.infos[1].text, "Identity Object");
  EXPECT_EQ(run.events.infos[1].index, 0x1018);
  EXPECT_EQ(run.events.infos[2].kind, SdoInfo::Kind::kEntry);
  EXPECT_EQ(run.events.infos[2].bit_length, 8);
  EXPECT_EQ(run.events.infos[3].text, "Number of entries");
  EXPECT_EQ(run.events.infos[3].access, 0x000F);
}

/// Real hardware: 35 uploads, as Wireshark decodes them.
TEST(RealTransfers, SoemReadsTheMappingOfAnAkd) {
  REQUIRE_CAPTURES();
  MailboxRun run(CapturePath("real/soem-sdinfo-akd.pcapng"));
  const auto& all = run.events.transfers;
  ASSERT_EQ(all.size(), 35U);
  for (const KeptTransfer& t : all) {
    EXPECT_EQ(t.service, SdoService::kUpload);
    EXPECT_EQ(t.kind, SdoTransferKind::kExpedited);
    EXPECT_EQ(t.outcome, SdoOutcome::kCompleted);
    EXPECT_EQ(t.certainty, Certainty::kObserved);
  }
  EXPECT_EQ(all[0].index, 0x1C00);
  EXPECT_EQ(all[0].request.number, 281U);
  EXPECT_EQ(all[0].response.number, 290U);
  EXPECT_EQ(all[0].bytes, FromHex("04"));
  EXPECT_EQ(all[3].bytes, FromHex("0016"));      // 1C12h:1
  EXPECT_EQ(all[5].bytes, FromHex("10004060"));  // 1600h:1 = 6040h, 16 bits
  std::size_t control_words = 0;
  for (const KeptTransfer& t : all) control_words += t.bytes == FromHex("10004060") ? 1U : 0U;
  EXPECT_EQ(control_words, 4U);  // 6040h mapped four times
  for (const KeptMessage& m : run.events.messages) {
    EXPECT_EQ(m.problem, Problem::kNone);
    EXPECT_NE(m.counter_step, CounterStep::kSkipped);
    EXPECT_NE(m.counter_step, CounterStep::kSame);
  }
  EXPECT_TRUE(run.events.unexpected.empty());
  EXPECT_TRUE(run.events.unanswered.empty());
  EXPECT_TRUE(run.events.refused.empty());
}

TEST(RealTransfers, SafetyCouplerAndEvaluationBoard) {
  REQUIRE_CAPTURES();
  MailboxRun upload(CapturePath("real/replay-ek1914-segmented-upload.pcapng"));
  ASSERT_EQ(upload.events.transfers.size(), 1U);
  EXPECT_EQ(Text(upload.events.transfers[0].bytes), "EK1914");
  EXPECT_EQ(upload.events.transfers[0].kind, SdoTransferKind::kNormal);
  EXPECT_EQ(upload.events.transfers[0].index, 0x1008);

  MailboxRun configuration(CapturePath("real/replay-ek1914-no-complete-access.pcapng"));
  EXPECT_EQ(configuration.events.transfers.size() * 2, configuration.events.messages.size());
  EXPECT_FALSE(configuration.events.transfers.empty());
  for (const KeptTransfer& t : configuration.events.transfers) EXPECT_EQ(t.outcome, SdoOutcome::kCompleted);
  EXPECT_TRUE(configuration.events.unexpected.empty());

  MailboxRun lan(CapturePath("real/soem-single-lan9252.pcapng"));
  ASSERT_EQ(lan.events.transfers.size(), 6U);
  for (const KeptTransfer& t : lan.events.transfers) {
    EXPECT_TRUE(t.complete_access);
    EXPECT_EQ(t.outcome, SdoOutcome::kCompleted);
  }
  EXPECT_EQ(lan.events.transfers[0].bytes, FromHex("040001020304"));
  EXPECT_EQ(lan.events.transfers[1].bytes, FromHex("01000116"));
  EXPECT_EQ(lan.events.transfers[1].kind, SdoTransferKind::kExpedited);
  EXPECT_EQ(lan.events.transfers[2].size, 38U);
}

TEST(RealTransfers, NoMailboxTrafficIsNoMailboxTraffic) {
  REQUIRE_CAPTURES();
  for (const char* name : {"real/replay-dc", "real/twincat-run-ek1100-el1004", "lab/mid-run"}) {
    MailboxRun run(CapturePath(std::string(name) + ".pcapng"));
    EXPECT_TRUE(run.ran);
    EXPECT_TRUE(run.events.messages.empty()) << name;
    EXPECT_TRUE(run.events.refused.empty()) << name;
  }
}

TEST(LabTransfers, TheNetworkReportsTheSame) {
  REQUIRE_CAPTURES();
  for (const char* name : {"sdo-mix", "startup-ok-3slaves", "soem-slaveinfo-akd", "mailbox-error-reply", "dc"}) {
    SCOPED_TRACE(name);
    MailboxRun run(CapturePath(std::string("lab/") + name + ".pcapng"));
    EXPECT_EQ(run.network_messages, run.events.messages.size());
    ASSERT_EQ(run.network_transfers.size(), run.events.transfers.size());
    for (std::size_t i = 0; i < run.network_transfers.size(); ++i) {
      EXPECT_EQ(run.network_transfers[i].bytes, run.events.transfers[i].bytes);
      EXPECT_EQ(run.network_transfers[i].outcome, run.events.transfers[i].outcome);
      EXPECT_EQ(run.network_transfers[i].slave, run.events.transfers[i].slave);
    }
  }
}

/// The same start-up with one direction missing.
TEST(LabTransfers, OneDirection) {
  REQUIRE_CAPTURES();
  MailboxRun both(CapturePath("lab/startup-ok-1slave.pcapng"));
  MailboxRun outbound(CapturePath("lab/startup-ok-1slave-outbound-only.pcapng"));
  MailboxRun returned(CapturePath("lab/startup-ok-1slave-return-only.pcapng"));
  const auto& expected = both.events.transfers;
  ASSERT_EQ(expected.size(), 33U);
  ASSERT_EQ(outbound.events.transfers.size(), expected.size());
  ASSERT_EQ(returned.events.transfers.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const KeptTransfer& r = returned.events.transfers[i];
    EXPECT_EQ(r.bytes, expected[i].bytes);
    EXPECT_EQ(r.outcome, expected[i].outcome);
    EXPECT_EQ(r.certainty, Certainty::kObserved);
    const KeptTransfer& o = outbound.events.transfers[i];
    EXPECT_EQ(o.service, expected[i].service);
    EXPECT_EQ(o.index, expected[i].index);
    EXPECT_EQ(o.subindex, expected[i].subindex);
    EXPECT_EQ(o.outcome, SdoOutcome::kNotCaptured);
    EXPECT_EQ(o.certainty, Certainty::kInferred);
    if (o.service == SdoService::kDownload) {
      EXPECT_EQ(o.bytes, expected[i].bytes);
    }
  }
  EXPECT_TRUE(outbound.events.unanswered.empty());
  EXPECT_TRUE(returned.events.unanswered.empty());
}

}  // namespace
}  // namespace ecaudit::mailbox
