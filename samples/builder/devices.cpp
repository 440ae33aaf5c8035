#include "samples/builder/devices.h"

namespace ecaudit::samples {
namespace {

struct PdoContent {
  std::uint16_t index;
  std::vector<std::uint32_t> entries;  // object, subindex, bits as in a mapping object
};

// AKD fieldbus manual 4.5.
const std::vector<PdoContent>& AkdPdos() {
  static const std::vector<PdoContent> kPdos{
      {0x1701, {0x60C10120, 0x60400010}},
      {0x1702, {0x60FF0020, 0x60400010}},
      {0x1720, {0x60400010, 0x60C10120, 0x20A40010, 0x60B20010, 0x60FE0110}},
      {0x1721, {0x60C10120, 0x60400010, 0x60B20010}},
      {0x1B01, {0x60630020, 0x60410010}},
      {0x1B20,
       {0x60630020, 0x20500020, 0x606C0020, 0x60FD0020, 0x60F40020, 0x20A00020, 0x60410010, 0x60770010, 0x20A50010,
        0x34700410}},
      {0x1B21, {0x60630020, 0x60410010}},
  };
  return kPdos;
}

void AddPdo(ObjectDictionary& objects, const PdoContent& pdo) {
  objects.AddNumber(pdo.index, 0, static_cast<std::uint8_t>(pdo.entries.size()), false, "PDO mapping");
  std::uint8_t subindex = 0;
  for (const std::uint32_t entry : pdo.entries) objects.AddNumber(pdo.index, ++subindex, entry, false, "mapped object");
}

/// The types of the sync managers, and what is assigned to those of process data.
void AddAssignments(ObjectDictionary& objects, std::uint16_t rx_pdo, std::uint16_t tx_pdo) {
  constexpr std::uint8_t kTypes[] = {1, 2, 3, 4};
  objects.AddNumber(0x1C00, 0, std::uint8_t{4}, false, "Sync manager types");
  for (std::uint8_t i = 0; i < 4; ++i) {
    objects.AddNumber(0x1C00, static_cast<std::uint8_t>(i + 1), kTypes[i], false, "type");
  }
  objects.AddNumber(0x1C12, 0, std::uint8_t{1}, true, "RxPDO assign");
  objects.AddNumber(0x1C12, 1, rx_pdo, true, "PDO");
  objects.AddNumber(0x1C13, 0, std::uint8_t{1}, true, "TxPDO assign");
  objects.AddNumber(0x1C13, 1, tx_pdo, true, "PDO");
}

void AddDriveObjects(ObjectDictionary& objects, const SiiContent& sii) {
  objects.AddNumber(0x1000, 0, std::uint32_t{0x00020192}, false, "Device type");
  objects.AddNumber(0x1001, 0, std::uint8_t{0}, false, "Error register");
  objects.AddText(0x1008, "AKD", "Manufacturer device name");
  objects.AddText(0x100A, "M_01-03-00-012 simulated by ecaudit", "Manufacturer software version");
  objects.AddNumber(0x1018, 0, std::uint8_t{4}, false, "Identity object");
  objects.AddNumber(0x1018, 1, sii.vendor_id, false, "Vendor ID");
  objects.AddNumber(0x1018, 2, sii.product_code, false, "Product code");
  objects.AddNumber(0x1018, 3, sii.revision, false, "Revision");
  objects.AddNumber(0x1018, 4, sii.serial, false, "Serial number");
  objects.AddNumber(0x6040, 0, std::uint16_t{0}, true, "Control word");
  objects.AddNumber(0x6041, 0, std::uint16_t{0x0250}, false, "Status word");
  objects.AddNumber(0x6060, 0, std::int8_t{7}, true, "Modes of operation");
  objects.AddNumber(0x6061, 0, std::int8_t{7}, false, "Modes of operation display");
  objects.AddNumber(0x6063, 0, std::int32_t{0}, false, "Position actual internal value");
  objects.AddNumber(0x6064, 0, std::int32_t{0}, false, "Position actual value");
  objects.AddNumber(0x606C, 0, std::int32_t{0}, false, "Velocity actual value");
  objects.AddNumber(0x6077, 0, std::int16_t{0}, false, "Torque actual value");
  objects.AddNumber(0x60B2, 0, std::int16_t{0}, true, "Torque feed forward");
  objects.AddNumber(0x60C1, 0, std::uint8_t{1}, false, "Interpolation data record");
  objects.AddNumber(0x60C1, 1, std::int32_t{0}, true, "Position command value");
  objects.AddNumber(0x60C2, 0, std::uint8_t{2}, false, "Interpolation time period");
  objects.AddNumber(0x60C2, 1, std::uint8_t{1}, true, "Interpolation time units");
  objects.AddNumber(0x60C2, 2, std::int8_t{-3}, true, "Interpolation time index");
  objects.AddNumber(0x60F4, 0, std::int32_t{0}, false, "Following error actual value");
  objects.AddNumber(0x60FD, 0, std::uint32_t{0}, false, "Digital inputs");
  objects.AddNumber(0x60FE, 0, std::uint8_t{1}, false, "Digital outputs");
  objects.AddNumber(0x60FE, 1, std::uint32_t{0}, true, "Digital outputs");
  objects.AddNumber(0x60FF, 0, std::int32_t{0}, true, "Velocity command value");
  objects.AddNumber(0x2050, 0, std::int32_t{0}, false, "Second position feedback");
  objects.AddNumber(0x20A0, 0, std::int32_t{0}, false, "Latch position 1, positive edge");
  objects.AddNumber(0x20A1, 0, std::int32_t{0}, false, "Latch position 1, negative edge");
  objects.AddNumber(0x20A2, 0, std::int32_t{0}, false, "Latch position 2, positive edge");
  objects.AddNumber(0x20A3, 0, std::int32_t{0}, false, "Latch position 2, negative edge");
  objects.AddNumber(0x20A4, 0, std::uint16_t{0}, true, "Latch control word");
  objects.AddNumber(0x20A5, 0, std::uint16_t{0}, false, "Latch status word");
  objects.AddNumber(0x3470, 0, std::uint8_t{4}, false, "Analog input");
  objects.AddNumber(0x3470, 4, std::int16_t{0}, false, "Analog input value");
}

SiiPdo ToSii(const PdoContent& pdo, std::uint8_t sync_manager, const ObjectDictionary& objects) {
  SiiPdo out{.index = pdo.index, .sync_manager = sync_manager};
  for (const std::uint32_t entry : pdo.entries) {
    const auto index = static_cast<std::uint16_t>(entry >> 16U);
    const auto subindex = static_cast<std::uint8_t>(entry >> 8U & 0xFFU);
    const ObjectEntry* object = objects.Find(index, subindex);
    out.entries.push_back(
        {index, subindex, static_cast<std::uint8_t>(entry & 0xFFU), object != nullptr ? object->name : ""});
  }
  return out;
}

}  // namespace

SlaveDescription AkdDrive() {
  SlaveDescription akd;
  akd.name = "AKD";
  akd.is_drive = true;
  akd.has_latches = true;
  akd.outputs_start = kAkdOutputs;
  akd.inputs_start = kAkdInputs;
  akd.esc.eeprom_emulated = true;
  SiiContent& sii = akd.sii;
  sii.pdi_control = 0x0C08;  // 16-bit microcontroller, SYNC and latch units on
  sii.vendor_id = 0x0000006A;
  sii.product_code = 0x00414B44;
  sii.revision = 2;
  sii.serial = 0;
  sii.mailbox_out_start = kAkdMailboxOut;
  sii.mailbox_out_length = kAkdMailboxBytes;
  sii.mailbox_in_start = kAkdMailboxIn;
  sii.mailbox_in_length = kAkdMailboxBytes;
  sii.mailbox_protocols = 0x04;
  sii.coe_details = 0x07;
  sii.group = "Drives";
  sii.name = "AKD";
  sii.fmmu_functions = {1, 2, 3};
  sii.sync_managers = {{kAkdMailboxOut, kAkdMailboxBytes, 0x26, 1, 1},
                       {kAkdMailboxIn, kAkdMailboxBytes, 0x22, 1, 2},
                       {kAkdOutputs, 6, 0x64, 1, 3},
                       {kAkdInputs, 6, 0x20, 1, 4}};
  for (const PdoContent& pdo : AkdPdos()) AddPdo(akd.objects, pdo);
  AddAssignments(akd.objects, 0x1701, 0x1B01);
  AddDriveObjects(akd.objects, sii);
  for (const PdoContent& pdo : AkdPdos()) {
    // Only the PDOs assigned by default belong to a sync manager.
    if (pdo.index == 0x1701) sii.rx_pdos.push_back(ToSii(pdo, 2, akd.objects));
    if (pdo.index == 0x1B01) sii.tx_pdos.push_back(ToSii(pdo, 3, akd.objects));
  }
  return akd;
}

SlaveDescription InputTerminal() {
  SlaveDescription terminal;
  terminal.name = "IN8";
  terminal.esc.information = {0x11, 0x00, 0x02, 0x00, 4, 4, 1, 0x05, 0xCC, 0x00};
  terminal.esc.device_emulation = true;
  SiiContent& sii = terminal.sii;
  sii.pdi_control = 0x0104;  // digital I/O, device emulation
  sii.vendor_id = 0x00000E0E;
  sii.product_code = 0x00000108;
  sii.revision = 0x00010000;
  sii.group = "Terminals";
  sii.name = "IN8";
  sii.fmmu_functions = {2};
  sii.sync_managers = {{0x1000, 1, 0x00, 1, 4}};
  sii.tx_pdos = {{0x1A00, 0, "Inputs", {{0x6000, 1, 8, "Inputs"}}}};
  return terminal;
}

SlaveDescription AcmeServo() {
  constexpr std::uint16_t kMailboxBytes = 256;
  SlaveDescription servo;
  servo.name = "AS-400";
  servo.outputs_start = 0x1400;
  servo.inputs_start = 0x1500;
  servo.esc.eeprom_emulated = true;
  SiiContent& sii = servo.sii;
  sii.pdi_control = 0x0C08;
  sii.vendor_id = 0x00000ACE;
  sii.product_code = 0x00005E40;
  sii.revision = 0x00010002;
  sii.mailbox_out_start = 0x1000;
  sii.mailbox_out_length = kMailboxBytes;
  sii.mailbox_in_start = 0x1200;
  sii.mailbox_in_length = kMailboxBytes;
  sii.mailbox_protocols = 0x04;
  sii.coe_details = 0x0F;
  sii.group = "Drives";
  sii.name = "AS-400";
  sii.fmmu_functions = {1, 2};
  sii.sync_managers = {{sii.mailbox_out_start, kMailboxBytes, 0x26, 1, 1},
                       {sii.mailbox_in_start, kMailboxBytes, 0x22, 1, 2},
                       {servo.outputs_start, 8, 0x64, 1, 3},
                       {servo.inputs_start, 8, 0x20, 1, 4}};
  ObjectDictionary& objects = servo.objects;
  objects.AddNumber(0x1000, 0, std::uint32_t{0x00020192}, false, "Device type");
  objects.AddNumber(0x1018, 0, std::uint8_t{4}, false, "Identity object");
  objects.AddNumber(0x1018, 1, sii.vendor_id, false, "Vendor ID");
  objects.AddNumber(0x1018, 2, sii.product_code, false, "Product code");
  objects.AddNumber(0x1018, 3, sii.revision, false, "Revision");
  objects.AddNumber(0x6040, 0, std::uint16_t{0}, true, "Controlword");
  objects.AddNumber(0x6041, 0, std::uint16_t{0x0250}, false, "Statusword");
  objects.AddNumber(0x6060, 0, std::int8_t{8}, true, "Modes of operation");
  objects.AddNumber(0x6061, 0, std::int8_t{8}, false, "Modes of operation display");
  objects.AddNumber(0x6064, 0, std::int32_t{0}, false, "Position actual value");
  objects.AddNumber(0x607A, 0, std::int32_t{0}, true, "Target position");
  const std::vector<PdoContent> pdos{{0x1600, {0x60400010, 0x607A0020, 0x60600008, 0x00000008}},
                                     {0x1A00, {0x60410010, 0x60640020, 0x60610008, 0x00000008}}};
  for (const PdoContent& pdo : pdos) AddPdo(objects, pdo);
  AddAssignments(objects, 0x1600, 0x1A00);
  sii.rx_pdos.push_back(ToSii(pdos[0], 2, objects));
  sii.tx_pdos.push_back(ToSii(pdos[1], 3, objects));
  return servo;
}

}  // namespace ecaudit::samples
