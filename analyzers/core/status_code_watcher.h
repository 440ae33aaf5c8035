/// Base of the rules that look at AL status codes: collects each code together with what it answers.
#pragma once

#include <vector>

#include "analyzers/core/rule.h"

namespace ecaudit {

class StatusCodeWatcher : public Rule {
 public:
  using Rule::On;
  explicit StatusCodeWatcher(const RuleInfo& info);

  void On(const model::AlAnswered& e) override;
  void On(const model::AlChangedByItself& e) override;
  void On(const model::AlErrorCode& e) override;
  /// Points each finding of this rule to the refusal or change whose code it is about.
  void Finish() override;

 protected:
  struct Context {
    SlaveId slave = kNoSlave;
    FrameRef frame;           ///< the read that showed the code
    std::uint16_t code = 0;
    std::uint8_t from = 0;    ///< state before, 0 when not known
    std::uint8_t to = 0;      ///< requested state; 0: the error appeared without a request
  };
  /// A code was read for the first time since the error appeared.
  virtual void OnCode(const Context& c) = 0;

 private:
  void Hand(Context& c, const FrameRef& frame, std::uint16_t code);
  Context& Remember(SlaveId slave, std::uint8_t from, std::uint8_t to);

  std::vector<Context> last_;
};

}  // namespace ecaudit
