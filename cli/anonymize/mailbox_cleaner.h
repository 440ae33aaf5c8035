/// Takes out of mailbox messages what names people, places and devices, and the contents of files and networks.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "cli/anonymize/text_runs.h"
#include "decoder/mailbox/header.h"

namespace ecaudit::cli::anonymize {

/// How much was taken out.
struct Removed {
  std::uint64_t other_packets = 0;   ///< emptied: no EtherCAT
  std::uint64_t eeprom_words = 0;    ///< serial numbers, strings and vendor categories
  std::uint64_t sdo_values = 0;      ///< texts and serial numbers
  std::uint64_t network_frames = 0;  ///< fragments of EoE
  std::uint64_t file_parts = 0;      ///< messages of FoE with names, contents or texts
  std::uint64_t other_messages = 0;  ///< AoE, SoE and VoE
};

class MailboxCleaner {
 public:
  MailboxCleaner(Secrets& secrets, Removed& removed) : secrets_(secrets), removed_(removed) {}

  /// @param slave    any number that identifies the slave
  /// @param data     from the first byte of the mailbox on
  /// @param learned  texts that are blotted out wherever they stand in names of objects
  void Clean(std::uint32_t slave, mailbox::Direction direction, Bytes data, const Secrets& learned);

 private:
  void CleanSdo(std::uint32_t slave, mailbox::Direction direction, Bytes sdo);
  void CleanFoe(Bytes payload);
  void CleanEoe(Bytes payload);
  void CleanAoe(Bytes payload);
  void CleanNetId(Bytes net_id);

  Secrets& secrets_;
  Removed& removed_;
  /// Slaves with a segmented transfer of text in flight, by direction of the data.
  std::set<std::pair<std::uint32_t, mailbox::Direction>> text_segments_;
  std::map<std::string, std::uint8_t> net_ids_;
};

}  // namespace ecaudit::cli::anonymize
