#include "decoder/esc/register_map.h"

#include <array>

namespace ecaudit::esc {
namespace {

using enum EcatAccess;
using enum Unit;

// ---- fields. A register whose only content is a number has one field without a name.

constexpr Field kNumber8[] = {{"", 0, 8, NUMBER, {}}};
constexpr Field kHex8[] = {{"", 0, 8, HEX, {}}};
constexpr Field kHex16[] = {{"", 0, 16, HEX, {}}};
constexpr Field kHex64[] = {{"", 0, 64, HEX, {}}};
constexpr Field kNs32[] = {{"", 0, 32, NS, {}}};
constexpr Field kDcTime32[] = {{"", 0, 32, DC_TIME, {}}};
constexpr Field kDcTime64[] = {{"", 0, 64, DC_TIME, {}}};
constexpr Field kData8[] = {{"", 0, 8, DATA, {}}};

// 4.1
constexpr ValueText kEscTypes[] = {
    {0x04, "IP core"}, {0x11, "ET1100"}, {0x12, "ET1200"}, {0x90, "TI"}, {0xC0, "LAN9252"}};
constexpr Field kType[] = {{"", 0, 8, VALUE, kEscTypes}};
constexpr Field kRamSize[] = {{"", 0, 8, KIB, {}}};
constexpr ValueText kPortTypes[] = {{0, "none"}, {1, "not configured"}, {2, "EBUS"}, {3, "MII"}};
constexpr Field kPortDescriptor[] = {{"port 0", 0, 2, VALUE, kPortTypes},
                                     {"port 1", 2, 2, VALUE, kPortTypes},
                                     {"port 2", 4, 2, VALUE, kPortTypes},
                                     {"port 3", 6, 2, VALUE, kPortTypes}};
constexpr Field kFeatures[] = {{"byte-wise FMMU only", 0, 1, FLAG, {}},
                               {"unused register access", 1, 1, FLAG, {}},
                               {"DC", 2, 1, FLAG, {}},
                               {"64-bit DC", 3, 1, FLAG, {}},
                               {"low-jitter EBUS", 4, 1, FLAG, {}},
                               {"enhanced link detection EBUS", 5, 1, FLAG, {}},
                               {"enhanced link detection MII", 6, 1, FLAG, {}},
                               {"FCS errors separate", 7, 1, FLAG, {}},
                               {"enhanced SYNC activation", 8, 1, FLAG, {}},
                               {"no LRW", 9, 1, FLAG, {}},
                               {"no BRW/APRW/FPRW", 10, 1, FLAG, {}},
                               {"fixed FMMU/SM configuration", 11, 1, FLAG, {}}};

// 4.2
constexpr Field kEnable[] = {{"enabled", 0, 1, FLAG, {}}};
constexpr Field kProtection[] = {{"protected", 0, 1, FLAG, {}}};
constexpr ValueText kForwarding[] = {{0, "passes foreign frames"}, {1, "destroys foreign frames"}};
constexpr ValueText kLoops[] = {{0, "auto"}, {1, "auto close"}, {2, "always open"}, {3, "always closed"}};
constexpr ValueText kAliasStates[] = {{0, "alias disabled"}, {1, "alias enabled"}};
constexpr Field kDlControl[] = {
    {"", 0, 1, VALUE, kForwarding},   {"loops for 1 s only", 1, 1, FLAG, {}}, {"port 0", 8, 2, VALUE, kLoops},
    {"port 1", 10, 2, VALUE, kLoops}, {"port 2", 12, 2, VALUE, kLoops},       {"port 3", 14, 2, VALUE, kLoops},
    {"RX FIFO", 16, 3, NUMBER, {}},   {"low-jitter EBUS", 19, 1, FLAG, {}},   {"", 24, 1, VALUE, kAliasStates}};
constexpr ValueText kPortStates[] = {
    {0, "open without communication"}, {1, "closed"}, {2, "open"}, {3, "closed in spite of communication"}};
constexpr Field kDlStatus[] = {{"EEPROM loaded", 0, 1, FLAG, {}},
                               {"PDI watchdog ok", 1, 1, FLAG, {}},
                               {"enhanced link detection", 2, 1, FLAG, {}},
                               {"link 0", 4, 1, FLAG, {}},
                               {"link 1", 5, 1, FLAG, {}},
                               {"link 2", 6, 1, FLAG, {}},
                               {"link 3", 7, 1, FLAG, {}},
                               {"port 0", 8, 2, VALUE, kPortStates},
                               {"port 1", 10, 2, VALUE, kPortStates},
                               {"port 2", 12, 2, VALUE, kPortStates},
                               {"port 3", 14, 2, VALUE, kPortStates}};

// 4.3
constexpr Field kAlControl[] = {
    {"", 0, 4, AL_STATE, {}}, {"acknowledge", 4, 1, FLAG, {}}, {"identification request", 5, 1, FLAG, {}}};
constexpr Field kAlStatus[] = {{"", 0, 5, AL_STATUS, {}}, {"identification loaded", 5, 1, FLAG, {}}};
constexpr Field kAlStatusCode[] = {{"", 0, 16, AL_STATUS_CODE, {}}};
constexpr Field kLed[] = {{"code", 0, 4, NUMBER, {}}, {"override", 4, 1, FLAG, {}}};
constexpr ValueText kPdiTypes[] = {{0x00, "none"},
                                   {0x04, "digital I/O"},
                                   {0x05, "SPI"},
                                   {0x07, "bridge"},
                                   {0x08, "16-bit asynchronous microcontroller"},
                                   {0x09, "8-bit asynchronous microcontroller"},
                                   {0x0A, "16-bit synchronous microcontroller"},
                                   {0x0B, "8-bit synchronous microcontroller"},
                                   {0x10, "32 digital inputs"},
                                   {0x11, "24 digital inputs, 8 outputs"},
                                   {0x12, "16 digital inputs, 16 outputs"},
                                   {0x13, "8 digital inputs, 24 outputs"},
                                   {0x14, "32 digital outputs"},
                                   {0x80, "on-chip bus"}};
constexpr Field kPdiControl[] = {{"", 0, 8, VALUE, kPdiTypes}};
constexpr Field kEscConfiguration[] = {{"device emulation", 0, 1, FLAG, {}},
                                       {"enhanced link detection", 1, 1, FLAG, {}},
                                       {"SYNC unit", 2, 1, FLAG, {}},
                                       {"latch unit", 3, 1, FLAG, {}},
                                       {"enhanced link port 0", 4, 1, FLAG, {}},
                                       {"enhanced link port 1", 5, 1, FLAG, {}},
                                       {"enhanced link port 2", 6, 1, FLAG, {}},
                                       {"enhanced link port 3", 7, 1, FLAG, {}}};
constexpr Field kSyncLatchPdi[] = {{"SYNC0 pin", 0, 3, HEX, {}},
                                   {"SYNC0 to AL event", 3, 1, FLAG, {}},
                                   {"SYNC1 pin", 4, 3, HEX, {}},
                                   {"SYNC1 to AL event", 7, 1, FLAG, {}}};

// 4.4
constexpr Field kEcatEvents[] = {
    {"DC latch", 0, 1, FLAG, {}}, {"DL status", 2, 1, FLAG, {}}, {"AL status", 3, 1, FLAG, {}}, {"SM0", 4, 1, FLAG, {}},
    {"SM1", 5, 1, FLAG, {}},      {"SM2", 6, 1, FLAG, {}},       {"SM3", 7, 1, FLAG, {}},       {"SM4", 8, 1, FLAG, {}},
    {"SM5", 9, 1, FLAG, {}},      {"SM6", 10, 1, FLAG, {}},      {"SM7", 11, 1, FLAG, {}}};
constexpr Field kAlEvents[] = {
    {"AL control", 0, 1, FLAG, {}}, {"DC latch", 1, 1, FLAG, {}},      {"SYNC0", 2, 1, FLAG, {}},
    {"SYNC1", 3, 1, FLAG, {}},      {"SM activation", 4, 1, FLAG, {}}, {"EEPROM emulation", 5, 1, FLAG, {}},
    {"watchdog", 6, 1, FLAG, {}},   {"SM0", 8, 1, FLAG, {}},           {"SM1", 9, 1, FLAG, {}},
    {"SM2", 10, 1, FLAG, {}},       {"SM3", 11, 1, FLAG, {}},          {"SM4", 12, 1, FLAG, {}},
    {"SM5", 13, 1, FLAG, {}},       {"SM6", 14, 1, FLAG, {}},          {"SM7", 15, 1, FLAG, {}},
    {"SM8", 16, 1, FLAG, {}},       {"SM9", 17, 1, FLAG, {}},          {"SM10", 18, 1, FLAG, {}},
    {"SM11", 19, 1, FLAG, {}},      {"SM12", 20, 1, FLAG, {}},         {"SM13", 21, 1, FLAG, {}},
    {"SM14", 22, 1, FLAG, {}},      {"SM15", 23, 1, FLAG, {}}};

// 4.5
constexpr Field kWatchdogDivider[] = {{"", 0, 16, WATCHDOG_STEP, {}}};
constexpr Field kWatchdogTime[] = {{"", 0, 16, WATCHDOG_TIME, {}}};
constexpr ValueText kWatchdogStates[] = {{0, "expired"}, {1, "running or off"}};
constexpr Field kWatchdogStatus[] = {{"", 0, 1, VALUE, kWatchdogStates}};

// 4.6
constexpr ValueText kEepromOwners[] = {{0, "ECAT owns the EEPROM"}, {1, "EEPROM offered to the PDI"}};
constexpr Field kEepromConfiguration[] = {{"", 0, 1, VALUE, kEepromOwners}, {"taken back by force", 1, 1, FLAG, {}}};
constexpr Field kEepromPdi[] = {{"held by the PDI", 0, 1, FLAG, {}}};
constexpr Field kEepromControl[] = {{"", 8, 3, EEPROM_COMMAND, {}},
                                    {"write enable", 0, 1, FLAG, {}},
                                    {"busy", 15, 1, FLAG, {}},
                                    {"checksum error", 11, 1, FLAG, {}},
                                    {"not loaded", 12, 1, FLAG, {}},
                                    {"no acknowledge or invalid command", 13, 1, FLAG, {}},
                                    {"write without enable", 14, 1, FLAG, {}},
                                    {"emulated", 5, 1, FLAG, {}},
                                    {"8 bytes a read", 6, 1, FLAG, {}},
                                    {"2-byte addresses", 7, 1, FLAG, {}}};
constexpr Field kEepromAddress[] = {{"", 0, 32, WORD_ADDRESS, {}}};
constexpr Field kEepromData[] = {{"", 0, 64, DATA, {}}};

// 4.7
constexpr ValueText kMiiCommands[] = {{0, ""}, {1, "read"}, {2, "write"}};
constexpr Field kMiiControl[] = {{"", 8, 2, VALUE, kMiiCommands},          {"write enable", 0, 1, FLAG, {}},
                                 {"PDI may control", 1, 1, FLAG, {}},      {"link detection", 2, 1, FLAG, {}},
                                 {"PHY address offset", 3, 5, NUMBER, {}}, {"read error", 13, 1, FLAG, {}},
                                 {"command error", 14, 1, FLAG, {}},       {"busy", 15, 1, FLAG, {}}};
constexpr Field kPhyNumber[] = {{"", 0, 5, NUMBER, {}}};
constexpr Field kMiiEcat[] = {{"exclusive for ECAT", 0, 1, FLAG, {}}};
constexpr Field kMiiPdi[] = {{"PDI has access", 0, 1, FLAG, {}}, {"force reset", 1, 1, FLAG, {}}};
constexpr Field kPhyPort[] = {{"physical link", 0, 1, FLAG, {}},     {"link", 1, 1, FLAG, {}},
                              {"link status error", 2, 1, FLAG, {}}, {"read error", 3, 1, FLAG, {}},
                              {"partner error", 4, 1, FLAG, {}},     {"configuration updated", 5, 1, FLAG, {}}};

// 4.8
constexpr Field kLogical[] = {{"", 0, 32, HEX, {}}};
constexpr Field kBytes16[] = {{"", 0, 16, BYTES, {}}};
constexpr Field kBitNumber[] = {{"", 0, 3, BIT, {}}};
constexpr Field kFmmuType[] = {{"read", 0, 1, FLAG, {}}, {"write", 1, 1, FLAG, {}}};
constexpr Field kActive[] = {{"active", 0, 1, FLAG, {}}};
constexpr Field kReserved24[] = {{"", 0, 24, DATA, {}}};

// 4.9
constexpr ValueText kSmModes[] = {{0, "buffered"}, {1, "reserved mode 1"}, {2, "mailbox"}, {3, "reserved mode 3"}};
constexpr ValueText kSmDirections[] = {
    {0, "ECAT reads"}, {1, "ECAT writes"}, {2, "reserved direction 2"}, {3, "reserved direction 3"}};
constexpr Field kSmControl[] = {{"", 0, 2, VALUE, kSmModes},
                                {"", 2, 2, VALUE, kSmDirections},
                                {"ECAT irq", 4, 1, FLAG, {}},
                                {"PDI irq", 5, 1, FLAG, {}},
                                {"watchdog", 6, 1, FLAG, {}}};
constexpr ValueText kSmBuffers[] = {{0, ""}, {1, "1"}, {2, "2"}, {3, "none"}};
constexpr Field kSmStatus[] = {{"written", 0, 1, FLAG, {}},          {"read", 1, 1, FLAG, {}},
                               {"mailbox full", 3, 1, FLAG, {}},     {"last buffer", 4, 2, VALUE, kSmBuffers},
                               {"read buffer open", 6, 1, FLAG, {}}, {"write buffer open", 7, 1, FLAG, {}}};
constexpr Field kSmActivate[] = {{"enabled", 0, 1, FLAG, {}},
                                 {"repeat request", 1, 1, FLAG, {}},
                                 {"latch event ECAT", 6, 1, FLAG, {}},
                                 {"latch event PDI", 7, 1, FLAG, {}}};
constexpr Field kSmPdi[] = {{"deactivated", 0, 1, FLAG, {}}, {"repeat acknowledge", 1, 1, FLAG, {}}};

// 4.10
constexpr Field kSignedNs64[] = {{"", 0, 64, SIGNED_NS, {}}};
constexpr Field kTimeDifference[] = {{"", 0, 32, MAGNITUDE_NS, {}}};
constexpr Field kSpeedStart[] = {{"", 0, 15, NUMBER, {}}};
constexpr Field kSpeedDifference[] = {{"", 0, 16, SIGNED, {}}};
constexpr Field kFilter[] = {{"", 0, 4, NUMBER, {}}};
constexpr Field kCyclicControl[] = {
    {"SYNC by PDI", 0, 1, FLAG, {}}, {"latch 0 by PDI", 4, 1, FLAG, {}}, {"latch 1 by PDI", 5, 1, FLAG, {}}};
constexpr Field kActivation[] = {{"active", 0, 1, FLAG, {}},
                                 {"SYNC0", 1, 1, FLAG, {}},
                                 {"SYNC1", 2, 1, FLAG, {}},
                                 {"auto activation", 3, 1, FLAG, {}},
                                 {"start time extended", 4, 1, FLAG, {}},
                                 {"start time checked", 5, 1, FLAG, {}},
                                 {"near future", 6, 1, FLAG, {}},
                                 {"debug pulse", 7, 1, FLAG, {}}};
constexpr Field kPulse[] = {{"", 0, 16, TEN_NS, {}}};
constexpr Field kActivationStatus[] = {{"SYNC0 pending", 0, 1, FLAG, {}},
                                       {"SYNC1 pending", 1, 1, FLAG, {}},
                                       {"start time out of near future", 2, 1, FLAG, {}}};
constexpr Field kSyncStatus[] = {{"pulse not acknowledged", 0, 1, FLAG, {}}};
constexpr Field kLatchControl[] = {{"positive edge single", 0, 1, FLAG, {}}, {"negative edge single", 1, 1, FLAG, {}}};
constexpr Field kLatchStatus[] = {
    {"positive event", 0, 1, FLAG, {}}, {"negative event", 1, 1, FLAG, {}}, {"pin high", 2, 1, FLAG, {}}};

// ---- the table

constexpr auto kRegisters = std::to_array<Register>({
    // 4.1 information and addressing
    {0x0000, 1, "Type", READ, kType, "", 1, "TI"},
    {0x0001, 1, "Revision", READ, kHex8, "", 1, "TI"},
    {0x0002, 2, "Build", READ, kHex16, "", 2, "B2:13"},
    {0x0004, 1, "FMMUs supported", READ, kNumber8, "", 1, "CAP"},
    {0x0005, 1, "SyncManagers supported", READ, kNumber8, "", 1, "CAP"},
    {0x0006, 1, "RAM Size", READ, kRamSize, "", 1, "B2:13"},
    {0x0007, 1, "Port Descriptor", READ, kPortDescriptor, "", 1, "TI"},
    {0x0008, 2, "Features", READ, kFeatures, "none", 2, "TI"},
    {0x0010, 2, "Configured Station Address", READ_WRITE, kHex16, "", 2, "TI"},
    {0x0012, 2, "Configured Station Alias", READ, kHex16, "", 0, "TI, B1:93"},
    // 4.2 write protection, reset, data link
    {0x0020, 1, "Write Register Enable", READ_WRITE, kEnable, "not enabled", 0, "B1:115"},
    {0x0021, 1, "Write Register Protection", READ_WRITE, kProtection, "not protected", 0, "B1:115"},
    {0x0030, 1, "ESC Write Enable", READ_WRITE, kEnable, "not enabled", 0, "B1:115"},
    {0x0031, 1, "ESC Write Protection", READ_WRITE, kProtection, "not protected", 0, "B1:115"},
    {0x0040, 1, "ESC Reset ECAT", WRITE_EFFECT, kHex8, "", 0, "B2:13"},
    {0x0041, 1, "ESC Reset PDI", READ, kHex8, "", 0, "B2:13"},
    {0x0100, 4, "DL Control", READ_WRITE, kDlControl, "", 2, "TI, WS"},
    {0x0108, 2, "Physical Read/Write Offset", READ_WRITE, kHex16, "", 0, "TI"},
    {0x0110, 2, "DL Status", READ_ACKNOWLEDGE, kDlStatus, "", 2, "TI, WS"},
    // 4.3 application layer and PDI
    {0x0120, 2, "AL Control", WRITE_IF, kAlControl, "", 1, "B2:33"},
    {0x0130, 2, "AL Status", READ_ACKNOWLEDGE, kAlStatus, "", 1, "B2:34"},
    {0x0134, 2, "AL Status Code", READ, kAlStatusCode, "", 0, "B2:34"},
    {0x0138, 1, "RUN LED Override", READ_WRITE, kLed, "", 0, "SSC, B2:13; bits unverified"},
    {0x0139, 1, "ERR LED Override", READ_WRITE, kLed, "", 0, "SSC, B2:13; bits unverified"},
    {0x0140, 1, "PDI Control", READ, kPdiControl, "", 0, "WS, CAP"},
    {0x0141, 1, "ESC Configuration", READ, kEscConfiguration, "none", 0, "TI, WS"},
    {0x014E, 2, "PDI Information", READ, kHex16, "", 0, "B2:13"},
    {0x0150, 1, "PDI Configuration", READ, kHex8, "", 0, "B1:93"},
    {0x0151, 1, "SYNC/LATCH PDI Configuration", READ, kSyncLatchPdi, "", 0, "TI"},
    {0x0152, 2, "Extended PDI Configuration", READ, kHex16, "", 0, "B1:93"},
    // 4.4 events
    {0x0200, 2, "ECAT Event Mask", READ_WRITE, kEcatEvents, "none", 0, "TI, CAP"},
    {0x0204, 4, "PDI AL Event Mask", READ, kAlEvents, "none", 0, "TI, AKD 4.2.1"},
    {0x0210, 2, "ECAT Event Request", READ, kEcatEvents, "none", 0, "TI, KC"},
    {0x0220, 4, "AL Event Request", READ, kAlEvents, "none", 0, "TI, AKD 4.2.2"},
    // 4.5 error counters, watchdogs
    {0x0300, 1, "Invalid Frame Counter Port #", WRITE_CLEARS, kNumber8, "", 1, "TI"},
    {0x0301, 1, "RX Error Counter Port #", WRITE_CLEARS, kNumber8, "", 1, "TI"},
    {0x0308, 1, "Forwarded RX Error Counter Port #", WRITE_CLEARS, kNumber8, "", 0, "TI"},
    {0x030C, 1, "ECAT Processing Unit Error Counter", WRITE_CLEARS, kNumber8, "", 0, "TI"},
    {0x030D, 1, "PDI Error Counter", WRITE_CLEARS, kNumber8, "", 0, "B2:13"},
    {0x030E, 2, "PDI Error Code", READ, kHex16, "", 0, "KC"},
    {0x0310, 1, "Lost Link Counter Port #", WRITE_CLEARS, kNumber8, "", 0, "TI"},
    {0x0400, 2, "Watchdog Divider", READ_WRITE, kWatchdogDivider, "", 0, "TI, KC"},
    {0x0410, 2, "Watchdog Time PDI", READ_WRITE, kWatchdogTime, "", 0, "TI"},
    {0x0420, 2, "Watchdog Time Process Data", READ_WRITE, kWatchdogTime, "", 0, "TI, B2:57"},
    {0x0440, 2, "Watchdog Status Process Data", READ, kWatchdogStatus, "", 0, "B2:57, TI"},
    {0x0442, 1, "Watchdog Counter Process Data", WRITE_CLEARS, kNumber8, "", 0, "B2:57"},
    {0x0443, 1, "Watchdog Counter PDI", WRITE_CLEARS, kNumber8, "", 0, "B2:57"},
    // 4.6 EEPROM interface
    {0x0500, 1, "EEPROM Configuration", READ_WRITE, kEepromConfiguration, "", 1, "TI"},
    {0x0501, 1, "EEPROM PDI Access State", READ, kEepromPdi, "not held by the PDI", 1, "TI"},
    {0x0502, 2, "EEPROM Control/Status", WRITE_IF, kEepromControl, "idle", 2, "TI, WS"},
    {0x0504, 4, "EEPROM Address", WRITE_IF, kEepromAddress, "", 4, "KC, ECSPEC"},
    {0x0508, 8, "EEPROM Data", WRITE_IF, kEepromData, "", 4, "TI"},
    // 4.7 MII management
    {0x0510, 2, "MII Management Control/Status", WRITE_IF, kMiiControl, "idle", 0, "TI, WS"},
    {0x0512, 1, "PHY Address", WRITE_IF, kPhyNumber, "", 0, "TI, WS"},
    {0x0513, 1, "PHY Register Address", WRITE_IF, kPhyNumber, "", 0, "TI, WS"},
    {0x0514, 2, "PHY Data", WRITE_IF, kHex16, "", 0, "TI, WS"},
    {0x0516, 1, "MII Management ECAT Access State", WRITE_IF, kMiiEcat, "not claimed", 0, "TI, WS"},
    {0x0517, 1, "MII Management PDI Access State", WRITE_IF, kMiiPdi, "none", 0, "TI, WS"},
    {0x0518, 1, "PHY Port Status Port #", WRITE_IF, kPhyPort, "no link", 0, "TI, WS"},
    // 4.8 FMMUs
    {0x0600, 4, "FMMU# Logical Start", READ_WRITE, kLogical, "", 0, "TI"},
    {0x0604, 2, "FMMU# Length", READ_WRITE, kBytes16, "", 0, "TI"},
    {0x0606, 1, "FMMU# Logical Start Bit", READ_WRITE, kBitNumber, "", 0, "TI"},
    {0x0607, 1, "FMMU# Logical Stop Bit", READ_WRITE, kBitNumber, "", 0, "TI"},
    {0x0608, 2, "FMMU# Physical Start", READ_WRITE, kHex16, "", 0, "TI"},
    {0x060A, 1, "FMMU# Physical Start Bit", READ_WRITE, kBitNumber, "", 0, "TI"},
    {0x060B, 1, "FMMU# Type", READ_WRITE, kFmmuType, "none", 0, "TI"},
    {0x060C, 1, "FMMU# Activate", READ_WRITE, kActive, "inactive", 0, "TI"},
    {0x060D, 3, "FMMU# Reserved", READ, kReserved24, "", 0, "TI"},
    // 4.9 sync managers
    {0x0800, 2, "SM# Start", WRITE_IF, kHex16, "", 0, "B2:68"},
    {0x0802, 2, "SM# Length", WRITE_IF, kBytes16, "", 0, "B2:68, B1:65"},
    {0x0804, 1, "SM# Control", WRITE_IF, kSmControl, "", 0, "TI, WS"},
    {0x0805, 1, "SM# Status", READ, kSmStatus, "none", 0, "TI"},
    {0x0806, 1, "SM# Activate", READ_WRITE, kSmActivate, "disabled", 0, "TI"},
    {0x0807, 1, "SM# PDI Control", READ, kSmPdi, "none", 0, "TI, B1:66"},
    // 4.10 distributed clocks
    {0x0900, 4, "Receive Time Port 0", WRITE_EFFECT, kDcTime32, "", 0, "TI, B2:74"},
    {0x0904, 4, "Receive Time Port #", READ, kDcTime32, "", 0, "B2:74"},
    {0x0910, 8, "System Time", WRITE_EFFECT, kDcTime64, "", 0, "B2:75, B1:78"},
    {0x0918, 8, "Receive Time ECAT Processing Unit", READ, kDcTime64, "", 0, "B2:74"},
    {0x0920, 8, "System Time Offset", READ_WRITE, kSignedNs64, "", 0, "B2:75"},
    {0x0928, 4, "System Time Delay", READ_WRITE, kNs32, "", 0, "B2:76"},
    {0x092C, 4, "System Time Difference", READ, kTimeDifference, "", 0, "B2:76"},
    {0x0930, 2, "Speed Counter Start", WRITE_EFFECT, kSpeedStart, "", 0, "B2:76"},
    {0x0932, 2, "Speed Counter Diff", READ, kSpeedDifference, "", 0, "B2:76"},
    {0x0934, 1, "System Time Difference Filter Depth", READ_WRITE, kFilter, "", 0, "TI, KC"},
    {0x0935, 1, "Speed Counter Filter Depth", READ_WRITE, kFilter, "", 0, "TI, KC"},
    {0x0980, 1, "Cyclic Unit Control", READ_WRITE, kCyclicControl, "all by ECAT", 0, "WS, TI"},
    {0x0981, 1, "Activation", WRITE_IF, kActivation, "off", 0, "B2:80"},
    {0x0982, 2, "Pulse Length", READ, kPulse, "", 0, "B2:80"},
    {0x0984, 1, "Activation Status", READ, kActivationStatus, "none", 0, "B2:81"},
    {0x098E, 1, "SYNC0 Status", READ_ACKNOWLEDGE, kSyncStatus, "none", 0, "B2:81"},
    {0x098F, 1, "SYNC1 Status", READ_ACKNOWLEDGE, kSyncStatus, "none", 0, "B2:81"},
    {0x0990, 8, "Start Time Cyclic Operation", WRITE_IF, kDcTime64, "", 0, "TI"},
    {0x0998, 8, "Next SYNC1 Pulse", READ, kDcTime64, "", 0, "TI"},
    {0x09A0, 4, "SYNC0 Cycle Time", WRITE_IF, kNs32, "", 0, "TI, B1:82"},
    {0x09A4, 4, "SYNC1 Cycle Time", WRITE_IF, kNs32, "", 0, "TI"},
    {0x09A8, 1, "Latch0 Control", WRITE_IF, kLatchControl, "continuous", 0, "WS, B1:85"},
    {0x09A9, 1, "Latch1 Control", WRITE_IF, kLatchControl, "continuous", 0, "WS, B1:85"},
    {0x09AE, 1, "Latch0 Status", READ, kLatchStatus, "no event", 0, "WS"},
    {0x09AF, 1, "Latch1 Status", READ, kLatchStatus, "no event", 0, "WS"},
    {0x09B0, 8, "Latch0 Time Positive Edge", READ_ACKNOWLEDGE, kDcTime64, "", 0, "B1:85"},
    {0x09B8, 8, "Latch0 Time Negative Edge", READ_ACKNOWLEDGE, kDcTime64, "", 0, "B1:85"},
    {0x09C0, 8, "Latch1 Time Positive Edge", READ_ACKNOWLEDGE, kDcTime64, "", 0, "B1:85"},
    {0x09C8, 8, "Latch1 Time Negative Edge", READ_ACKNOWLEDGE, kDcTime64, "", 0, "B1:85"},
    {0x09F0, 4, "ECAT Buffer Change Event Time", READ, kDcTime32, "", 0, "B1:85"},
    {0x09F8, 4, "PDI Buffer Start Event Time", READ, kDcTime32, "", 0, "B1:85"},
    {0x09FC, 4, "PDI Buffer Change Event Time", READ, kDcTime32, "", 0, "B1:85"},
    // Others
    {0x0E00, 8, "Product ID", READ, kHex64, "", 0, "esc-reference 4.10"},
    {0x0E08, 8, "Vendor ID", READ, kHex64, "", 0, "esc-reference 4.10"},
    {0x0E10, 240, "ESC specific", WRITE_IF, kData8, "", 0, "esc-reference 4.10"},
    {0x0F00, 4, "Digital Output Data", READ_WRITE, kLogical, "", 0, "CAP"},
    {0x0F10, 8, "General Purpose Outputs", READ_WRITE, kHex64, "", 0, "unverified"},
    {0x0F80, 128, "User RAM", READ_WRITE, kData8, "", 0, "B1:115"},
});

constexpr auto kUnits = std::to_array<RegisterUnit>({
    {0x0300, 2, 4, 0, ""},
    {0x0308, 1, 4, 0, ""},
    {0x0310, 1, 4, 0, ""},
    {0x0518, 1, 4, 0, ""},
    {0x0600, 16, 16, 0, "FMMU"},
    {0x0800, 8, 16, 0, "SM"},
    {0x0904, 4, 3, 1, ""},
});

constexpr bool Sorted() {
  for (std::size_t i = 1; i < kRegisters.size(); ++i) {
    if (kRegisters[i].address < kRegisters[i - 1].address + kRegisters[i - 1].length) return false;
  }
  for (std::size_t i = 1; i < kUnits.size(); ++i) {
    if (kUnits[i].address < kUnits[i - 1].address + kUnits[i - 1].size * kUnits[i - 1].count) return false;
  }
  return true;
}
static_assert(Sorted(), "registers and units must ascend and not overlap");

constexpr bool UnitsRepeatWhatIsInTheTable() {
  for (const RegisterUnit& unit : kUnits) {
    std::size_t bytes = 0;
    for (const Register& reg : kRegisters) {
      const bool first = reg.address >= unit.address && reg.address < unit.address + unit.size;
      const bool later = reg.address >= unit.address + unit.size && reg.address < unit.address + unit.size * unit.count;
      if (first) bytes += reg.length;
      if (later || (first && reg.name.find('#') == std::string_view::npos)) return false;
    }
    if (bytes != unit.size) return false;
  }
  return true;
}
static_assert(UnitsRepeatWhatIsInTheTable(), "a unit consists of numbered registers without gaps, listed once");

/// First byte of the reserved run's end: the next register or unit instance after `address`, or kProcessRam.
std::uint32_t EndOfReserved(EscAddress address) {
  // Units have no gaps inside, so a reserved run ends where a table entry begins.
  const auto next = std::upper_bound(kRegisters.begin(), kRegisters.end(), address,
                                     [](EscAddress value, const Register& reg) { return value < reg.address; });
  return next == kRegisters.end() ? kProcessRam : next->address;
}

bool AnyPart(EscAddress address, std::size_t length, bool (*matches)(const RegisterPart&)) {
  bool any = false;
  CutAccess(address, length, [&](const RegisterPart& part) { any = any || matches(part); });
  return any;
}

}  // namespace

std::span<const Register> AllRegisters() {
  return kRegisters;
}
std::span<const RegisterUnit> AllRegisterUnits() {
  return kUnits;
}

const RegisterUnit* FindRegisterUnit(EscAddress address) {
  for (const RegisterUnit& unit : kUnits) {
    if (address >= unit.address && address < unit.address + unit.size * unit.count) return &unit;
  }
  return nullptr;
}

RegisterHit RegisterAt(EscAddress address) {
  if (address >= kProcessRam) return {};
  RegisterHit hit;
  hit.unit = FindRegisterUnit(address);
  unsigned shift = 0;  // from the first instance
  if (hit.unit != nullptr) {
    const unsigned instance = static_cast<unsigned>(address - hit.unit->address) / hit.unit->size;
    shift = instance * hit.unit->size;
    hit.number = static_cast<std::uint8_t>(hit.unit->first_number + instance);
  }
  const auto in_table = static_cast<EscAddress>(address - shift);
  const auto next = std::upper_bound(kRegisters.begin(), kRegisters.end(), in_table,
                                     [](EscAddress value, const Register& reg) { return value < reg.address; });
  if (next == kRegisters.begin()) return {};
  const Register& reg = *(next - 1);
  if (in_table >= reg.address + reg.length) return {};
  hit.reg = &reg;
  hit.start = static_cast<EscAddress>(reg.address + shift);
  hit.offset = static_cast<std::uint16_t>(in_table - reg.address);
  return hit;
}

const Register* FindRegister(EscAddress address) {
  return RegisterAt(address).reg;
}

std::string RegisterName(const RegisterHit& hit) {
  if (hit.reg == nullptr) return {};
  std::string name(hit.reg->name);
  if (const std::size_t at = name.find('#'); at != std::string::npos) name.replace(at, 1, std::to_string(hit.number));
  return name;
}

std::string RegisterName(EscAddress address) {
  return address >= kProcessRam ? "Process RAM" : RegisterName(RegisterAt(address));
}

std::string AccessName(EscAddress address, std::size_t length) {
  std::string first;
  std::string last;
  bool units = true;
  const auto add = [&](std::string name, bool is_unit = false) {
    if (first.empty()) first = name;
    last = std::move(name);
    units = units && is_unit;
  };
  length = std::min<std::size_t>(length, kAddressSpace - address);
  const std::uint32_t end = address + static_cast<std::uint32_t>(length);
  CutAccess(address, length, [&](const RegisterPart& part) {
    if (part.is_process_ram()) return add("Process RAM");
    if (!part.hit) return;
    const RegisterUnit* unit = part.hit.unit;
    if (unit != nullptr && !unit->name.empty()) {
      // Within one register its own name is more precise; from two on the unit's.
      const std::uint32_t unit_start =
          unit->address + static_cast<std::uint32_t>(part.address - unit->address) / unit->size * unit->size;
      const std::uint32_t covered =
          std::min<std::uint32_t>(end, unit_start + unit->size) - std::max<std::uint32_t>(address, unit_start);
      if (covered > part.length) return add(std::string(unit->name) + std::to_string(part.hit.number), true);
    }
    add(RegisterName(part.hit));
  });
  if (first == last) return first;
  return first + (units ? "-" : " - ") + last;
}

RegisterPart PartAt(EscAddress address, std::size_t length, std::size_t at) {
  RegisterPart part;
  part.address = static_cast<EscAddress>(address + at);
  part.at = at;
  part.hit = RegisterAt(part.address);
  std::size_t size = 0;  // to the end of the register or run
  if (part.is_process_ram()) {
    size = kAddressSpace - part.address;
  } else if (part.hit) {
    size = static_cast<std::size_t>(part.hit.reg->length - part.hit.offset);
  } else {
    size = EndOfReserved(part.address) - part.address;
  }
  part.length = std::min(size, length - at);
  part.complete = part.hit && part.hit.offset == 0 && part.length == part.hit.reg->length;
  return part;
}

bool EveryEscReads(EscAddress address, std::size_t length) {
  return AnyPart(address, length,
                 [](const RegisterPart& part) { return part.hit && part.hit.offset < part.hit.reg->mandatory_bytes; });
}

bool EveryEscWrites(EscAddress address, std::size_t length) {
  return AnyPart(address, length, [](const RegisterPart& part) {
    return part.hit && part.hit.offset < part.hit.reg->mandatory_bytes &&
           (part.hit.reg->access == READ_WRITE || part.hit.reg->access == WRITE_CLEARS);
  });
}

bool NothingToWrite(EscAddress address, std::size_t length) {
  if (length == 0) return false;
  return !AnyPart(address, length, [](const RegisterPart& part) {
    return part.is_process_ram() || (part.hit && !IsReadOnly(part.hit.reg->access));
  });
}

}  // namespace ecaudit::esc
