#include "decoder/track/eeprom_reporter.h"

namespace ecaudit::track {

void EepromReporter::OnEepromRead(const EepromRead& event) {
  events_.Publish(event);
  // Words 8-15: vendor, product code, revision, serial number (esc-reference 11.1).
  if (event.address >= 16 || event.address + event.words.size() <= 8) return;
  const esc::SiiImage& image = states_[event.slave].sii.image();
  IdentityLearned identity;
  identity.slave = event.slave;
  identity.frame = event.frame;
  identity.source = IdentityLearned::Source::kEeprom;
  identity.vendor_id = image.DoubleWord(8);
  identity.product_code = image.DoubleWord(10);
  identity.revision = image.DoubleWord(12);
  identity.serial = image.DoubleWord(14);
  if (identity.vendor_id || identity.product_code) events_.Publish(identity);
}

}  // namespace ecaudit::track
