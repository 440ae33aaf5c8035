/// Base of the rules that check AL status codes: collects each code together with the request that it answers.
#pragma once

#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/model/model_events.h"
#include "decoder/device/device_description.h"

namespace ecaudit {

class StatusCodeWatcher : public Rule {
 public:
  explicit StatusCodeWatcher(const RuleInfo& info);

  virtual void On(const model::AlAnswered& e);
  virtual void On(const model::AlChangedByItself& e);
  virtual void On(const model::AlErrorCode& e);
  /// Points each finding of this rule to the refusal or change whose code it is about.
  void Finish() override;

 protected:
  struct Context {
    SlaveId slave = kNoSlave;
    FrameRef frame;  ///< the read that showed the code
    std::uint16_t code = 0;
    std::uint8_t from = 0;  ///< state before, 0 when not known
    std::uint8_t to = 0;    ///< requested state; 0: the error appeared without a request
  };
  /// A code was read for the first time since the error appeared.
  virtual void OnCode(const Context& c) = 0;
  /// True if the manual does not list the code for this request, but the profile expects it of real firmware.
  [[nodiscard]] static bool Tolerates(const device::DeviceDescription& family, const Context& c);

 private:
  void Evaluate(Context& c, const FrameRef& frame, std::uint16_t code);
  Context& Remember(SlaveId slave, const FrameRef& frame, std::uint8_t from, std::uint8_t to);
  void AddUnread(const Context& c);

  std::vector<Context> last_;  // of each slave; frame number 0 once its code was read
};

}  // namespace ecaudit
