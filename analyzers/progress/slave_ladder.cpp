#include <algorithm>

#include "analyzers/progress/ladder.h"
#include "analyzers/result/absence.h"
#include "decoder/esc/al.h"

namespace ecaudit::progress {
namespace {

constexpr Word kAnswers{"answers", "answers"};
constexpr Word kKnown{"known", "identity known"};
constexpr Word kPreop{"preop", "PREOP"};
constexpr Word kMailbox{"mailbox", "mailbox works"};
constexpr Word kConfigured{"configured", "configuration accepted"};
constexpr Word kSafeop{"safeop", "SAFEOP"};
constexpr Word kExchange{"exchange", "exchanges process data"};
constexpr Word kOp{"op", "OP"};
constexpr Word kSync{"sync", "in sync"};

constexpr Word kGone{"gone", "the slave does not answer any more"};
constexpr Word kNoState{"no-al-status", "AL Status is not in the capture"};
constexpr Word kNoStateAfter{"no-al-status-after-request", "AL Status after the request is not in the capture"};
constexpr Word kNoIdentity{"no-identity", "the identity is not in the capture"};
constexpr Word kNoAnswers{"no-answers", "the slave does not answer the mailbox"};
constexpr Word kNoReturns{"no-returned-frames", "returned frames are not in the capture"};
constexpr Word kNoExchange{"no-exchange", "the working counter shows no exchange"};
constexpr Word kNoProcessData{"no-process-data", "process data of the slave are not in the capture"};
constexpr Word kUnplaced{"process-data-unknown", "the place of its process data is not in the capture"};
constexpr Word kNoPhase{"no-phase", "the capture does not show when frames arrive"};
constexpr Word kStateShown{"state-not-shown", "AL Status does not show the requested state"};
constexpr Word kStateLeft{"state-left", "the slave left the state without a request"};
constexpr Word kStateGone{"state-gone", "AL Status does not show the state any more"};

std::uint8_t StateOf(std::uint16_t word) {
  return esc::AlWord{word}.state();
}

constexpr std::uint8_t kBoot = 3;

bool IsAtLeast(std::uint8_t state, esc::AlState wanted) {
  return state != kBoot && state >= static_cast<std::uint8_t>(wanted);
}

/// A rung that is an AL state.
Rung StateRung(const Word& word, esc::AlState wanted, const SlaveSummary& slave, const AnalysisResult& result) {
  Rung rung;
  rung.rung = &word;
  bool asked = false;
  bool asked_below = false;
  bool shown = false;
  for (const AlStep& step : slave.al_history) {
    const std::uint8_t state = StateOf(step.to);
    if (step.kind == AlStep::Kind::kRequest) {
      asked = asked || IsAtLeast(state, wanted);
      asked_below = !IsAtLeast(state, wanted);
      continue;
    }
    shown = true;
    if (IsAtLeast(state, wanted)) {
      if (!rung.since.seen() || rung.until.seen()) rung.since = step.frame;
      rung.until = {};
      rung.status = RungStatus::kReached;
    } else if (rung.since.seen() && !rung.until.seen()) {
      rung.until = step.frame;
      rung.status = asked_below ? RungStatus::kReached : RungStatus::kLost;
    }
    // A request stays what the master wants while the slave passes the states between; a refused one does not.
    if (esc::AlWord{step.to}.bit4() && !step.echo) asked_below = false;
  }
  const bool by_status = slave.al_status && IsAtLeast(StateOf(*slave.al_status), wanted);
  if (!rung.since.seen() && by_status) {
    rung.status = RungStatus::kReached;
  } else if (!rung.since.seen()) {
    rung.status = !shown && !slave.al_status ? RungStatus::kUnknown
                  : asked                    ? RungStatus::kNotReached
                                             : RungStatus::kNotAsked;
    if (rung.status == RungStatus::kUnknown) rung.why = &kNoState;
  }
  if (rung.status == RungStatus::kNotReached || rung.status == RungStatus::kLost) {
    rung.held_by = HolderOf(result, slave,
                            {"al-refused", "al-timeout", "al-unexpected-change", "al-error-standing",
                             "al-illegal-transition", "al-invalid-request", "al-error-not-acknowledged"},
                            {.lost = rung.until});
    // Without a finding the request may be among the frames that the capture misses.
    const Word& left = rung.held_by == kNoFinding ? kStateGone : kStateLeft;
    rung.why = rung.status == RungStatus::kLost ? &left : &kStateShown;
    // A master that stopped reading AL Status does not show what became of its request.
    if (rung.held_by == kNoFinding && rung.status == RungStatus::kNotReached) {
      rung.status = RungStatus::kUnknown;
      rung.why = &kNoStateAfter;
    }
  }
  return rung;
}

Rung AnswersRung(const SlaveSummary& slave, const AnalysisResult& result) {
  Rung rung;
  rung.rung = &kAnswers;
  rung.status = RungStatus::kReached;
  for (const AlStep& step : slave.al_history) {
    if (step.kind == AlStep::Kind::kState) {
      rung.since = step.frame;
      break;
    }
  }
  for (const Absence& absence : AbsencesOf(slave, result)) {
    if (!absence.whole || absence.to.seen()) continue;
    rung.status = RungStatus::kLost;
    rung.until = absence.from;
    rung.why = &kGone;
    rung.held_by = RootOf(result, absence.finding);
    break;
  }
  return rung;
}

Rung KnownRung(const SlaveSummary& slave) {
  Rung rung;
  rung.rung = &kKnown;
  if (slave.identity.vendor_id || slave.identity.product_code) {
    rung.status = RungStatus::kReached;
    rung.since.number = slave.identity.since;
  } else {
    rung.why = &kNoIdentity;
  }
  return rung;
}

Rung MailboxRung(const SlaveSummary& slave, const AnalysisResult& result) {
  Rung rung;
  rung.rung = &kMailbox;
  const MailboxSummary& mailbox = slave.mailbox;
  if (mailbox.responses > 0) {
    rung.status = RungStatus::kReached;
  } else if (mailbox.requests == 0) {
    rung.status = RungStatus::kNotAsked;
  } else if (result.capture.direction == DirectionSeen::kOutbound) {
    rung.why = &kNoReturns;
  } else {
    rung.status = RungStatus::kNotReached;
    rung.why = &kNoAnswers;
    rung.held_by = HolderOf(result, slave,
                            {"mailbox-no-response", "mailbox-not-active", "mailbox-overrun", "mailbox-counter",
                             "mailbox-malformed", "sm-mailbox-config"});
  }
  return rung;
}

Rung ConfiguredRung(const SlaveSummary& slave, const AnalysisResult& result) {
  Rung rung;
  rung.rung = &kConfigured;
  const FindingIndex holder =
      HolderOf(result, slave,
               {"sdo-abort", "sdo-wrong-size", "sdo-write-read-only", "sdo-unknown-object", "sm-process-config",
                "sm-mailbox-config", "sm-overlap", "fmmu-mismatch", "fmmu-inactive", "pdo-assign-order",
                "pdo-assign-state", "pdo-length-mismatch", "pdo-mapping-rule", "pdo-not-mappable", "pdo-object-type",
                "pdo-unsupported", "mailbox-error-reply"});
  const bool written = slave.mailbox.sdo_downloads > 0 || !slave.sync_managers.empty() || !slave.fmmus.empty();
  if (holder != kNoFinding) {
    rung.status = RungStatus::kNotReached;
    rung.held_by = holder;
  } else if (!written) {
    rung.status = RungStatus::kNotAsked;
  } else if (result.capture.direction == DirectionSeen::kOutbound) {
    rung.why = &kNoReturns;
  } else {
    rung.status = RungStatus::kReached;
  }
  return rung;
}

Rung ExchangeRung(const SlaveSummary& slave, const AnalysisResult& result, RungStatus safeop) {
  Rung rung;
  rung.rung = &kExchange;
  const PdoSummary& rx = slave.rx_pdo;
  const PdoSummary& tx = slave.tx_pdo;
  const bool has_outputs = rx.bytes.value_or(0) > 0;
  const bool has_inputs = tx.bytes.value_or(0) > 0;
  const bool outputs_missing = has_outputs && rx.exchanged == 0;
  const bool inputs_missing = has_inputs && tx.exchanged == 0;
  const bool some = rx.exchanged > 0 || tx.exchanged > 0;
  const auto is_process = [](const SyncManagerSummary& m) { return m.enabled && !m.mailbox && m.length > 0; };
  const bool managers = std::any_of(slave.sync_managers.begin(), slave.sync_managers.end(), is_process);
  if (some && !outputs_missing && !inputs_missing) {
    rung.status = RungStatus::kReached;
    rung.since.number = rx.exchanged == 0 ? tx.first : tx.exchanged == 0 ? rx.first : std::max(rx.first, tx.first);
  } else if ((safeop == RungStatus::kReached || safeop == RungStatus::kLost) && (has_outputs || has_inputs) &&
             slave.op_requested()) {
    rung.held_by =
        HolderOf(result, slave, {"wkc-never-right", "wkc-mismatch", "fmmu-mismatch", "fmmu-inactive", "al-refused"});
    // A capture may end before the first process data.
    rung.status = rung.held_by != kNoFinding ? RungStatus::kNotReached : RungStatus::kUnknown;
    rung.why = rung.held_by != kNoFinding ? &kNoExchange : &kNoProcessData;
  } else if (some || managers) {
    rung.why = &kUnplaced;
  } else {
    rung.status = RungStatus::kNotAsked;
  }
  return rung;
}

Rung SyncRung(const SlaveSummary& slave, const AnalysisResult& result, RungStatus op) {
  Rung rung;
  rung.rung = &kSync;
  const bool activated = slave.dc && slave.dc->activated.seen();
  const FindingIndex holder =
      HolderOf(result, slave,
               {"sync-lost", "sync-cycle-mismatch", "sync-cycle-unsupported", "sync-difference-large", "sync-jitter",
                "sync-drift-uncompensated", "sync-not-activated", "sync-op-before-sync", "sync-rate-deviation",
                "sync-start-in-past", "sync-switched-off", "sync-type-mismatch", "sync-window-violation"});
  if (holder != kNoFinding) {
    rung.status = op == RungStatus::kReached ? RungStatus::kLost : RungStatus::kNotReached;
    rung.held_by = holder;
  } else if (!activated) {
    rung.status = RungStatus::kNotAsked;
  } else if (op != RungStatus::kReached) {
    rung.status = op == RungStatus::kNotAsked ? RungStatus::kNotAsked : op;
  } else if (!slave.dc->phase) {
    rung.why = &kNoPhase;
  } else {
    rung.status = RungStatus::kReached;
    rung.since = slave.dc->activated;
  }
  return rung;
}

}  // namespace

void LoseAbove(const Rung& answers, Ladder& ladder) {
  if (answers.status != RungStatus::kLost) return;
  for (Rung& rung : ladder.rungs) {
    // What was read of the slave stays known.
    if (rung.status != RungStatus::kReached || rung.until.seen() || rung.rung == &kKnown) continue;
    rung.status = RungStatus::kLost;
    rung.until = answers.until;
    rung.why = answers.why;
    rung.held_by = answers.held_by;
  }
}

namespace {

/// A rung that fails explains those above it that have no explanation of their own.
void ExplainFromBelow(Ladder& ladder) {
  FindingIndex below = kNoFinding;
  for (Rung& rung : ladder.rungs) {
    const bool failed = rung.status == RungStatus::kNotReached || rung.status == RungStatus::kLost;
    if (rung.held_by == kNoFinding && below != kNoFinding && (failed || rung.why == &kNoStateAfter)) {
      rung.held_by = below;
      if (!failed) {
        rung.status = RungStatus::kNotReached;
        rung.why = &kStateShown;
      }
    }
    if (failed && below == kNoFinding) below = rung.held_by;
  }
}

}  // namespace

Ladder LadderOf(const SlaveSummary& slave, const AnalysisResult& result) {
  Ladder ladder;
  const auto add = [&](Rung rung) { ladder.rungs.push_back(std::move(rung)); };
  add(AnswersRung(slave, result));
  add(KnownRung(slave));
  add(StateRung(kPreop, esc::AlState::PREOP, slave, result));
  add(MailboxRung(slave, result));
  add(ConfiguredRung(slave, result));
  const Rung safeop = StateRung(kSafeop, esc::AlState::SAFEOP, slave, result);
  const Rung op = StateRung(kOp, esc::AlState::OP, slave, result);
  add(safeop);
  add(ExchangeRung(slave, result, safeop.status));
  add(op);
  add(SyncRung(slave, result, op.status));
  ExplainFromBelow(ladder);
  LoseAbove(ladder.rungs.front(), ladder);
  return ladder;
}

}  // namespace ecaudit::progress
