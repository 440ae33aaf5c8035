#include "cli/lookup/progress_meanings.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <span>
#include <string>

namespace ecaudit::cli::lookup {
namespace {

struct RungPage {
  std::string_view rung;  ///< as in reports
  std::string_view of;    ///< "slave" or "axis"
  std::string_view reached;
  std::string_view held;
  std::string_view look;  ///< registers and objects that show it
  std::string_view rules;
};

constexpr std::array kRungs{
    RungPage{"answers", "slave", "a returned frame counts the slave (working counter)",
             "cable, port, power or address; the cable of the master in an OUT socket",
             "0x0110 DL Status: the ports with a link; ecaudit check: Topology",
             "bus-no-answer, bus-slave-count-changed, bus-link-errors, frame-lost"},
    RungPage{"known", "slave",
             "vendor and product are read from the EEPROM or object 1018h, or given by --esi or --eni",
             "EEPROM unreadable, blank or of another device", "EEPROM words 0x0008 to 0x000b; 1018h",
             "eeprom-written, startup-value"},
    RungPage{"preop", "slave", "AL Status shows PREOP, SAFEOP or OP",
             "mailbox sync managers that do not fit, EEPROM, firmware that does not start",
             "0x0130 AL Status, 0x0134 AL status code (0x0016, 0x0015); SM0 and SM1 at 0x0800",
             "al-refused, al-timeout, sm-mailbox-config"},
    RungPage{"mailbox", "slave", "the slave answers in its mailbox",
             "a full mailbox that the master does not read, a wrong counter, an emergency taken for the answer",
             "SM0 and SM1 status at 0x0805 and 0x080d; ecaudit events",
             "mailbox-no-response, mailbox-overrun, mailbox-counter, mailbox-malformed, mailbox-not-active"},
    RungPage{"configured", "slave", "what the master wrote is accepted, and its mapping fits the slave",
             "refused entries, lengths that contradict the type of an object, a mapping changed outside PREOP",
             "1C12h, 1C13h, 1600h and following, 1A00h and following; SDO abort codes",
             "sdo-abort, pdo-object-type, pdo-not-mappable, pdo-length-mismatch, sm-process-config"},
    RungPage{"safeop", "slave", "AL Status shows SAFEOP or OP",
             "the sync manager, PDO or clock setting that the AL status code names",
             "0x0134 (0x001d outputs, 0x001e inputs, 0x0030 to 0x0037 clocks); SM2 and SM3 at 0x0810",
             "al-refused, al-timeout, sm-process-config, fmmu-mismatch"},
    RungPage{"exchange", "slave", "the working counter counts the slave in each direction that it has",
             "LRW to a slave that does not support it, an FMMU that points elsewhere, no datagram for the slave",
             "0x0008 bit 9 (LRW), 0x0600 FMMUs; the working counter of each datagram in ecaudit decode",
             "wkc-never-right, wkc-mismatch, fmmu-mismatch, fmmu-inactive"},
    RungPage{"op", "slave", "AL Status shows OP", "no outputs, the watchdog, SYNC0 missing or too late",
             "0x0134 (0x001b watchdog, 0x001a and 0x002c to 0x0033 synchronisation); 0x0400, 0x0420 watchdog",
             "al-refused, al-unexpected-change, sync-watchdog-margin, sync-lost"},
    RungPage{
        "sync", "slave", "SYNC0 is active, and the frames arrive between its pulses",
        "a master with jitter or without lock to the reference clock, frames at the pulse, cycle times that differ",
        "0x0981 activation, 0x09a0 cycle, 0x092c difference; 60C2h, 1C32h, 1C33h",
        "sync-window-violation, sync-cycle-mismatch, sync-difference-large, sync-not-activated"},
    RungPage{"no-fault", "axis", "the status word shows no Fault",
             "the fault that the drive reports; a reset (bit 7) that has no rising edge",
             "6041h; 603Fh, 1003h, emergencies: ecaudit explain NUMBER",
             "drive-fault, emcy-received, drive-not-enabled"},
    RungPage{"voltage", "axis", "bit 4 of the status word is 1, or the axis is enabled",
             "no supply of the motor, safe torque off, hardware enable input", "6041h bit 4", "drive-not-enabled"},
    RungPage{
        "enabled", "axis", "the status word shows Operation enabled",
        "a bit of the control word that stays 0 (bit 2 is active at 0), a missing edge of bit 3 or 7, a control word "
        "by SDO that process data overwrite, a slave that is not in OP",
        "6040h, 6041h; the enable sequence is 0x0006, 0x0007, 0x000f, each after the status word shows the state",
        "drive-not-enabled, drive-illegal-command, drive-no-reaction, drive-control-outside-op"},
    RungPage{
        "mode", "axis", "6061h shows the mode that 6060h selects",
        "6060h in the process data with 0, SDO and process data that disagree, a mode that the drive does not have",
        "6060h, 6061h, 6502h", "drive-not-commanded, drive-mode-not-shown, drive-unsupported-mode"},
    RungPage{
        "commanded", "axis",
        "the set point changes while the axis is enabled, or bit 4 rises (profile position, "
        "homing)",
        "bit 4 without a rising edge, halt (bit 8), a set point that is not mapped or that belongs to another mode",
        "6040h bits 4 and 8; 607Ah, 60FFh, 6071h", "drive-not-commanded, drive-setpoint-jump"},
    RungPage{"follows", "axis", "the actual value goes where the set point goes",
             "following error, limits, homing error, a target far from the actual value when the axis is enabled",
             "6041h bits 11 and 13; 6064h, 606Ch, 6077h; 607Dh limits",
             "drive-not-following, drive-setpoint-jump, drive-fault"},
};

struct Question {
  std::string_view name;
  std::string_view other;  ///< another way to ask it
  std::string_view first;
  std::span<const std::string_view> rungs;  ///< from below
};

constexpr std::array<std::string_view, 8> kOfMoving{"op",   "no-fault",  "voltage", "enabled",
                                                    "mode", "commanded", "follows", "sync"};
constexpr std::array<std::string_view, 8> kOfReaching{"answers",    "known",  "preop",    "mailbox",
                                                      "configured", "safeop", "exchange", "op"};
constexpr std::array<std::string_view, 5> kOfDropping{"answers", "exchange", "op", "sync", "no-fault"};

constexpr std::array kQuestions{
    Question{"axis does not move", "drive does not move",
             "ecaudit check CAPTURE: under Progress, the line of the axis names the first rung that is not reached.",
             kOfMoving},
    Question{"does not reach OP", "does not go to OP",
             "ecaudit check CAPTURE: under Progress, the line of the slave names the first rung that is not reached. "
             "Record from before INIT on.",
             kOfReaching},
    Question{"drops out of OP", "falls out of OP",
             "ecaudit check CAPTURE: the finding al-unexpected-change has the frame. ecaudit signals --around '#FRAME' "
             "shows what the slave received before it.",
             kOfDropping},
};

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

const RungPage& PageOf(std::string_view rung) {
  return *std::ranges::find(kRungs, rung, &RungPage::rung);
}

void AddRung(const RungPage& page, std::vector<Meaning>& out) {
  Meaning& meaning = out.emplace_back();
  meaning.kind = page.of == "axis" ? "rung of an axis" : "rung of a slave";
  meaning.name = page.rung;
  meaning.details = {{"reached", std::string(page.reached)},
                     {"held by", std::string(page.held)},
                     {"look at", std::string(page.look)},
                     {"rules", std::string(page.rules)}};
}

}  // namespace

void AddProgress(std::string_view what, std::vector<Meaning>& out) {
  const std::string asked = Lower(what);
  for (const RungPage& page : kRungs) {
    if (asked == page.rung) AddRung(page, out);
  }
  for (const Question& question : kQuestions) {
    if (asked != Lower(question.name) && asked != Lower(question.other)) continue;
    Meaning& meaning = out.emplace_back();
    meaning.kind = "question";
    meaning.name = question.name;
    meaning.details = {{"first", std::string(question.first)}};
    for (const std::string_view rung : question.rungs) {
      const RungPage& page = PageOf(rung);
      meaning.details.emplace_back(std::string(rung),
                                   std::string(page.reached) + ". If not: " + std::string(page.held) +
                                       ". Look at: " + std::string(page.look) + ". Rules: " + std::string(page.rules));
    }
  }
}

std::vector<std::string_view> ProgressTopics() {
  std::vector<std::string_view> topics;
  for (const RungPage& page : kRungs) topics.push_back(page.rung);
  for (const Question& question : kQuestions) topics.push_back(question.name);
  return topics;
}

}  // namespace ecaudit::cli::lookup
