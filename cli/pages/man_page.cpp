#include <algorithm>
#include <cctype>

#include "cli/pages/command_table.h"
#include "cli/version.h"

namespace ecaudit::cli {
namespace {

/// Text of man(7): a line must not begin with . or ', minus signs are to be copied as such.
std::string Escaped(std::string_view text) {
  std::string out;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
    line_begins = c == '\n';
  }
  return out;
}

std::string Heading(const std::string& title, std::string_view summary) {
  std::string upper = title;
  std::ranges::transform(upper, upper.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return ".TH \"" + Escaped(upper) + "\" 1 \"\" \"ecaudit " + std::string(Version()) +
         "\" \"EtherCAT trace analysis\"\n" + ".SH NAME\n" + Escaped(title) + " \\- " + Escaped(summary) + "\n";
}

void AppendOptions(const CommandRow& command, std::string& out) {
  std::vector<std::string> groups;
  for (const OptionSet::Row& row : command.options) {
    const std::string group = row.argument ? "Arguments" : row.group.empty() ? "Options" : row.group;
    if (std::ranges::find(groups, group) == groups.end()) groups.push_back(group);
  }
  out += ".SH OPTIONS\n";
  for (const std::string& group : groups) {
    out += ".SS " + Escaped(group) + "\n";
    for (const OptionSet::Row& row : command.options) {
      if ((row.argument ? "Arguments" : row.group.empty() ? "Options" : row.group) != group) continue;
      std::string names;
      for (const std::string& name : NamesOf(row)) names += (names.empty() ? "" : ", ") + name;
      out += ".TP\n\\fB" + Escaped(names) + "\\fR";
      if (!row.value.empty()) out += " \\fI" + Escaped(row.value) + "\\fR";
      out += "\n" + Escaped(row.help) + "\n";
    }
  }
  out += ".TP\n\\fB\\-h, \\-\\-help\\fR\nThe same in short\n";
}

constexpr std::string_view kExitStatus =
    ".SH \"EXIT STATUS\"\n"
    ".TP\n0\nno finding at or above \\-\\-fail\\-on, and none that keeps the master from something it requested\n"
    ".TP\n1\nsuch a finding, or \\-\\-require is not met; diff: the captures differ; profiles \\-\\-check: "
    "mistakes\n"
    ".TP\n2\nwrong usage or unreadable input, with one line on standard error\n"
    ".TP\n3\nan internal error\n"
    ".TP\n130\ninterrupted; what was found so far is reported and marked incomplete\n";

}  // namespace

std::string ManPage(const CommandRow* command, const std::vector<CommandRow>& all) {
  std::string out;
  if (command != nullptr) {
    out += Heading("ecaudit-" + command->name, command->summary);
    out += ".SH SYNOPSIS\n\\fBecaudit " + Escaped(command->usage) + "\\fR [\\fIOPTIONS\\fR]\n";
    AppendOptions(*command, out);
    if (!command->footer.empty()) {
      const std::string& footer = command->footer;
      out += ".SH NOTES\n.nf\n" + Escaped(footer.substr(std::min(footer.find_first_not_of('\n'), footer.size()))) +
             "\n.fi\n";
    }
    out += kExitStatus;
    out += ".SH \"SEE ALSO\"\n\\fBecaudit\\fR(1)\n";
    return out;
  }
  out += Heading("ecaudit", "follows what each EtherCAT slave does in a capture, and reports what is wrong");
  out += ".SH SYNOPSIS\n\\fBecaudit\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR] ...\n";
  out +=
      ".SH DESCRIPTION\n"
      "Reads captures of EtherCAT traffic (pcap, pcapng, also compressed), replays them through a model of every "
      "slave, "
      "and reports each difference with its frames, the section of the manual and what to do. Nothing is sent.\n";
  out += ".SH COMMANDS\n";
  for (const CommandRow& row : all) {
    out += ".TP\n\\fB" + Escaped(row.usage) + "\\fR\n" + Escaped(row.summary) + "; see \\fBecaudit\\-" +
           Escaped(row.name) + "\\fR(1)\n";
  }
  out += kExitStatus;
  out +=
      ".SH FILES\n"
      ".TP\n.I .ecaudit.json\nsettings, searched beside each capture and in the folders above it\n"
      ".TP\n.I share/ecaudit/profiles\ndrive families for all users\n"
      ".SH ENVIRONMENT\n.TP\nNO_COLOR\nany value switches colours off\n"
      ".SH EXAMPLES\n.nf\necaudit check trace.pcapng\necaudit check \\-o report.html trace.pcapng\n"
      "ecaudit batch \\-o junit=summary.xml captures/\necaudit explain 0x001d\n.fi\n";
  out += ".SH \"SEE ALSO\"\n";
  for (const CommandRow& row : all) {
    out += "\\fBecaudit\\-" + Escaped(row.name) + "\\fR(1)" + (&row == &all.back() ? "\n" : ",\n");
  }
  return out;
}

}  // namespace ecaudit::cli
