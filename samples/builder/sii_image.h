/// The EEPROM of a slave (SII), built from parameters (esc-reference 11.1).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "samples/builder/wire_bytes.h"

namespace ecaudit::samples {

struct SiiSyncManager {
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;
  std::uint8_t enable = 1;
  std::uint8_t type = 0;  ///< 1 mailbox out, 2 mailbox in, 3 outputs, 4 inputs
};

struct SiiPdoEntry {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t bits = 0;
  std::string name{};
};

struct SiiPdo {
  std::uint16_t index = 0;
  std::uint8_t sync_manager = 0;
  std::string name{};
  std::vector<SiiPdoEntry> entries{};
};

struct SiiContent {
  std::uint16_t pdi_control = 0;  ///< word 0: 0x0140 and 0x0141
  std::uint16_t alias = 0;
  std::uint32_t vendor_id = 0;
  std::uint32_t product_code = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  std::uint16_t mailbox_out_start = 0;  ///< master to slave; all four 0 without a mailbox
  std::uint16_t mailbox_out_length = 0;
  std::uint16_t mailbox_in_start = 0;
  std::uint16_t mailbox_in_length = 0;
  std::uint16_t mailbox_protocols = 0;  ///< AoE 1, EoE 2, CoE 4, FoE 8, SoE 0x10, VoE 0x20
  std::uint8_t coe_details = 0;         ///< SDO 1, information 2, assign 4, configuration 8, upload 0x10, complete 0x20
  std::string group{};
  std::string name{};
  std::vector<std::uint8_t> fmmu_functions{};  ///< 1 outputs, 2 inputs, 3 mailbox status
  std::vector<SiiSyncManager> sync_managers{};
  std::vector<SiiPdo> tx_pdos{};
  std::vector<SiiPdo> rx_pdos{};
};

/// The image as words in wire order, 2 KiB: header with checksum, then the categories strings, general, FMMU, SyncM,
/// TxPDO, RxPDO and the end mark; erased cells are 0xFF.
[[nodiscard]] Bytes BuildSii(const SiiContent& content);
/// Checksum of words 0-6: polynomial x^8 + x^2 + x + 1, start value 0xFF.
[[nodiscard]] std::uint8_t SiiChecksum(ByteView first_14_bytes);

}  // namespace ecaudit::samples
