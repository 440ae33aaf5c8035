#include "analyzers/model/exchange_count.h"

#include <algorithm>

#include "analyzers/model/inputs_given.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit::model {
namespace {

/// Slaves in SAFEOP and OP give their inputs.
bool AllShouldGiveInputs(const LogicalExpectation& expectation, const track::Network& network) {
  return std::all_of(expectation.shares.begin(), expectation.shares.end(), [&](const LogicalShare& share) {
    if (!share.inputs) return true;
    const esc::AlWord* status = network.state(share.slave).al_status.if_known();
    return status != nullptr && status->state() >= static_cast<std::uint8_t>(esc::AlState::SAFEOP);
  });
}

CounterReading Read(const track::LogicalAccess& access, const LogicalExpectation& expectation, const EniCounts& eni,
                    const SlavesCounted& counted) {
  Facts<CounterFact> facts{};
  facts.Set(CounterFact::kNeverReturns, access.assumed);
  facts.Set(CounterFact::kReturned, access.returned.seen() && !access.circulating);
  facts.Set(CounterFact::kCounted, counted.wkc != 0);
  facts.Set(CounterFact::kEniCounter, eni.counter.has_value());
  facts.Set(CounterFact::kEniCounterMet, eni.counter == access.wkc);
  facts.Set(CounterFact::kMappingKnown, expectation.mapping_known || eni.any);
  facts.Set(CounterFact::kFull, counted.full());
  facts.Set(CounterFact::kPossible, counted.possible());
  return Decide(kReadCounter, facts);
}

}  // namespace

ExchangeOfAll ByNumber(const SlavesCounted& counted) {
  const auto assess = [](unsigned least, unsigned most, unsigned all) {
    if (least == all) return Exchange::kYes;
    return most == 0 ? Exchange::kNo : Exchange::kUnknown;
  };
  const unsigned least = counted.least_outputs();
  const unsigned most = counted.most_outputs();
  return {assess(counted.wkc - counted.step * most, counted.wkc - counted.step * least, counted.inputs),
          assess(least, most, counted.outputs)};
}

ExchangeOfAll CountExchange(const track::LogicalAccess& access, const LogicalExpectation& expectation,
                            const EniCounts& eni, const track::Network& network, const std::deque<SlaveModel>& slaves) {
  SlavesCounted counted;
  counted.inputs = access.command == wire::Command::LWR ? 0 : expectation.inputs + eni.inputs;
  counted.outputs = access.command == wire::Command::LRD ? 0 : expectation.outputs + eni.outputs;
  counted.step = access.command == wire::Command::LRW ? 2 : 1;
  counted.wkc = access.wkc;
  switch (Read(access, expectation, eni, counted)) {
    case CounterReading::kNothing:
      return {};
    case CounterReading::kTakenAsSent:
      return {Exchange::kUnknown, Exchange::kInferred};
    case CounterReading::kNobody:
      return {Exchange::kNo, Exchange::kNo};
    case CounterReading::kAllFit:
      return {Exchange::kInferred, Exchange::kInferred};
    case CounterReading::kByNumber:
      break;
  }
  const ExchangeOfAll by_number = ByNumber(counted);
  if (by_number.inputs != Exchange::kUnknown || counted.inputs == 0) return by_number;
  if (!AllShouldGiveInputs(expectation, network)) return by_number;
  Counting others;
  others.step = counted.step;
  others.inputs = others.miss = counted.inputs - expectation.inputs;
  others.take = counted.outputs - expectation.outputs;
  if (!AllInputsGiven(expectation, slaves, others, counted.wkc)) return by_number;
  const unsigned took = (counted.wkc - counted.inputs) / counted.step;
  if (took == counted.outputs) return {Exchange::kInferred, Exchange::kInferred};
  return {Exchange::kInferred, took == 0 ? Exchange::kNo : Exchange::kUnknown};
}

}  // namespace ecaudit::model
