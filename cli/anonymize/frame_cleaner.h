/// in: packets of a capture, twice.  out: the same packets without what names people, places and devices.
///
/// Sizes, times, headers of datagrams, working counters and process data stay. The first pass learns what the second
/// takes out: EEPROM contents are read word by word, so where a string begins shows only after it.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "cli/anonymize/eeprom_watch.h"
#include "cli/anonymize/mailbox_cleaner.h"
#include "cli/anonymize/mapped_mailboxes.h"
#include "cli/anonymize/text_runs.h"
#include "decoder/capture/frame_source.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli::anonymize {

class FrameCleaner {
 public:
  FrameCleaner() : mailboxes_(secrets_, removed_) {}

  /// First pass.
  void Learn(const capture::CapturedFrame& frame);
  void EndLearning();
  /// Second pass. @param bytes  a copy of the packet's bytes, which is changed
  void Clean(const capture::CapturedFrame& frame, std::vector<std::uint8_t>& bytes);

  [[nodiscard]] const Removed& removed() const { return removed_; }
  /// What must stand nowhere in the copy, after the second pass.
  [[nodiscard]] const Secrets& secrets() const { return secrets_; }
  [[nodiscard]] std::size_t addresses() const { return macs_.size(); }

 private:
  void CleanDatagram(const wire::DatagramView& datagram, Bytes data);
  void CleanEeprom(const wire::DatagramView& datagram, Bytes data);
  void CleanHeaders(const capture::CapturedFrame& frame, const wire::FrameView& view, Bytes bytes);
  void CleanMac(Bytes mac);
  void CleanUdp(Bytes bytes, std::size_t ethercat);

  EepromWatch eeprom_;
  MappedMailboxes mapped_;
  Secrets secrets_;
  Secrets learned_;  ///< of the first pass: names of objects may repeat them
  Removed removed_;
  MailboxCleaner mailboxes_;
  std::map<std::uint64_t, std::uint32_t> macs_;
  std::map<std::uint32_t, std::uint8_t> ip_addresses_;
};

}  // namespace ecaudit::cli::anonymize
