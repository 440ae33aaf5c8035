/// in: what EEPROM and objects of one slave show.  out: its identity, as far as the capture shows it.
///
/// Words 8 to 15 of the EEPROM, else object 1018h; the model type from object 1008h or the EEPROM's own category, by
/// which families are recognised whose product code no manual states.
#pragma once

#include <cstdint>
#include <string>

#include "decoder/esc/sii.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"

namespace ecaudit::model {

class SeenIdentity {
 public:
  explicit SeenIdentity(SlaveId slave) { known_.slave = slave; }

  [[nodiscard]] const track::IdentityLearned& known() const { return known_; }
  /// @return true when it is another device than before
  bool Learn(const track::IdentityLearned& event);
  /// What an answer to an upload of 1018h or 1008h shows.
  /// @return true when something is new
  bool Learn(const mailbox::SdoTransfer& transfer);
  /// Words of the EEPROM were read.
  void OnEepromRead(const FrameRef& frame) { eeprom_read_ = frame; }
  /// Looks for the model type in it, once more was read of it.
  /// @return true when it is new
  bool LookInto(const esc::SiiImage& eeprom);

 private:
  static constexpr std::uint8_t kLooks = 16;  ///< at an EEPROM: each goes through the whole of it

  bool LearnNumbers(const mailbox::SdoTransfer& transfer);
  bool LearnName(const mailbox::SdoTransfer& transfer);
  bool LearnModel(std::string model, const FrameRef& frame);

  track::IdentityLearned known_;
  FrameRef eeprom_read_;  ///< the last words since the last look; not seen: none
  std::uint8_t looks_ = 0;
};

}  // namespace ecaudit::model
