/// What usually leads to an AL status code: where to look first.
#include "cli/lookup/meanings.h"
#include "decoder/base/names.h"

namespace ecaudit::cli::lookup {
namespace {

constexpr Named<std::uint16_t> kCauses[] = {
    {0x0001, "an error that the firmware has no code for; read the diagnosis of the device"},
    {0x0011, "the master skipped a state (INIT to OP, PREOP to OP)"},
    {0x0012, "a value in AL Control that is no state, often bytes in the wrong order"},
    {0x0013, "the device has no bootstrap, or the firmware update is for another device"},
    {0x0014, "a firmware update that broke off"},
    {0x0015, "SM0 and SM1 are not set as the EEPROM demands for BOOT"},
    {0x0016,
     "SM0 and SM1 differ from the EEPROM in address, length or control byte; the ESI of the project is of another "
     "device or revision"},
    {0x0017,
     "a process data sync manager whose length is not that of the assigned PDOs, or whose address is not that of the "
     "EEPROM; PDOs were changed by SDO and the length in the project was not"},
    {0x0018, "inputs are not ready: a missing sensor, or an application that has not started"},
    {0x0019,
     "no process data arrive when OP is requested: the cyclic task of the master does not run yet, or its frames are "
     "not for this slave"},
    {0x001A,
     "frames come too late or not with SYNC0: jitter of the master, a wrong shift time, or clocks that are not "
     "distributed yet"},
    {0x001B,
     "no process data within the watchdog time: the master stopped, a breakpoint, a cable, or a cycle longer than the "
     "watchdog"},
    {0x001C, "the use of a sync manager (1C00h) is not what the slave expects"},
    {0x001D,
     "SM2 does not fit the RxPDOs: length, address or control byte; 1C12h was changed, or the project has other PDOs "
     "than the slave"},
    {0x001E,
     "SM3 does not fit the TxPDOs: length, address or control byte; 1C13h was changed, or the project has other PDOs "
     "than the slave"},
    {0x001F, "the watchdog is switched off or longer than the slave allows"},
    {0x0020, "a change that only power-on makes effective"},
    {0x0021, "the slave must be initialised again: INIT, then the states in order"},
    {0x0024, "an object that is not mappable, or too many, in the TxPDOs (1A00h...)"},
    {0x0025, "an object that is not mappable, or too many, in the RxPDOs (1600h...)"},
    {0x0026, "settings that exclude each other, for example synchronisation mode and cycle time"},
    {0x0027, "the project runs the slave without synchronisation, and it needs SM or DC synchronisation"},
    {0x002C, "SYNC0 stopped in OP: cyclic operation was switched off, or the clock of the slave was reset"},
    {0x002D,
     "SYNC0 never came: cyclic operation is not activated (0x0981), or its start time lies in the past or too far "
     "ahead"},
    {0x0030, "SYNC0 and SYNC1 do not fit the mode of the slave, or the mode is not set in 1C32h"},
    {0x0032, "the slave could not lock to SYNC0: jitter, or a cycle time that it does not support"},
    {0x0035, "a cycle time that the slave does not support; not a multiple of its base time"},
    {0x0050, "the EEPROM is assigned to the other side (0x0500), or it does not answer"},
};

}  // namespace

std::string_view UsualCauses(std::uint16_t al_status_code) {
  return NameIn(kCauses, al_status_code);
}

}  // namespace ecaudit::cli::lookup
