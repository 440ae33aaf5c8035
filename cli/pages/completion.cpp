/// Completion scripts. They hold all they offer, so that a key press starts no program.

#include "cli/pages/command_table.h"

namespace ecaudit::cli {
namespace {

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string WordsOf(const OptionSet::Row& row) {
  return row.words ? Joined(row.words()) : std::string();
}

/// Between single quotes of a shell.
std::string ShellQuoted(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string AllOptions(const CommandRow& command) {
  std::vector<std::string> names{"-h", "--help"};
  for (const OptionSet::Row& row : command.options) {
    if (row.argument) continue;
    for (const std::string& name : NamesOf(row)) names.push_back(name);
  }
  return Joined(names);
}

std::string Bash(const std::vector<CommandRow>& table) {
  std::string commands = "help version --help --version";
  std::string cases;
  for (const CommandRow& command : table) {
    commands += " " + command.name;
    cases += "    " + command.name + ")\n      options=" + ShellQuoted(AllOptions(command)) + "\n";
    std::string values;
    std::string words;
    for (const OptionSet::Row& row : command.options) {
      const std::string list = WordsOf(row);
      if (row.argument) {
        words = list.empty() ? words : list;
        continue;
      }
      if (row.value.empty()) continue;
      std::string names;
      for (const std::string& name : NamesOf(row)) names += (names.empty() ? "" : "|") + name;
      values += "        " + names + ") " + (list.empty() ? "files=1" : "words=" + ShellQuoted(list)) + ";;\n";
    }
    if (!values.empty()) cases += "      case \"$previous\" in\n" + values + "      esac\n";
    if (!words.empty()) cases += "      arguments=" + ShellQuoted(words) + "\n";
    cases += "      ;;\n";
  }
  return "# bash completion for ecaudit, written by 'ecaudit completion bash'\n"
         "_ecaudit() {\n"
         "  local current=\"${COMP_WORDS[COMP_CWORD]}\" previous=\"${COMP_WORDS[COMP_CWORD-1]}\"\n"
         "  local command=\"${COMP_WORDS[1]}\" options='' words='' arguments='' files=''\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" -le 1 ] || { [ \"$COMP_CWORD\" -eq 2 ] && [ \"$command\" = help ]; }; then\n"
         "    COMPREPLY=($(compgen -W " +
         ShellQuoted(commands) +
         " -- \"$current\"))\n"
         "    return\n"
         "  fi\n"
         "  case \"$command\" in\n" +
         cases +
         "  esac\n"
         "  if [ -n \"$words\" ]; then\n"
         "    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "    case \"${COMPREPLY[0]}\" in *=) compopt -o nospace 2>/dev/null;; esac\n"
         "  elif [ -z \"$files\" ] && [ \"${current#-}\" != \"$current\" ]; then\n"
         "    COMPREPLY=($(compgen -W \"$options\" -- \"$current\"))\n"
         "  elif [ -z \"$files\" ] && [ -n \"$arguments\" ]; then\n"
         "    COMPREPLY=($(compgen -W \"$arguments\" -- \"$current\"))\n"
         "  else\n"
         "    compopt -o filenames 2>/dev/null\n"
         "    COMPREPLY=($(compgen -f -- \"$current\"))\n"
         "  fi\n"
         "}\n"
         "complete -F _ecaudit ecaudit\n";
}

/// Of a specification of _arguments: its signs get a backslash.
std::string ZshText(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string Zsh(const std::vector<CommandRow>& table) {
  std::string commands;
  std::string cases;
  for (const CommandRow& command : table) {
    commands += "    " + ShellQuoted(command.name + ":" + ZshText(command.summary)) + "\n";
    cases += "    " + command.name + ")\n      _arguments -S \\\n        '(- *)'{-h,--help}'[This page]'";
    for (const OptionSet::Row& row : command.options) {
      const std::string list = WordsOf(row);
      const std::string action = list.empty() ? "_files" : "(" + list + ")";
      if (row.argument) {
        cases +=
            " \\\n        " + ShellQuoted(std::string(row.repeatable ? "*" : "1") + ":" + row.names + ":" + action);
        continue;
      }
      for (const std::string& name : NamesOf(row)) {
        std::string specification = (row.repeatable ? "*" : "") + name;
        // A long option takes its value after = as well.
        if (!row.value.empty()) specification += name.starts_with("--") ? "=" : "+";
        specification += "[" + ZshText(row.help) + "]";
        if (!row.value.empty()) specification += ":" + ZshText(row.value) + ":" + action;
        cases += " \\\n        " + ShellQuoted(specification);
      }
    }
    cases += "\n      ;;\n";
  }
  return "#compdef ecaudit\n"
         "# zsh completion for ecaudit, written by 'ecaudit completion zsh'\n"
         "_ecaudit() {\n"
         "  local -a commands\n"
         "  commands=(\n" +
         commands +
         "  )\n"
         "  if (( CURRENT == 2 )); then\n"
         "    _describe command commands\n"
         "    return\n"
         "  fi\n"
         "  local command=${words[2]}\n"
         "  shift words\n"
         "  (( CURRENT-- ))\n"
         "  case $command in\n" +
         cases +
         "    help) _describe command commands;;\n"
         "  esac\n"
         "}\n"
         "_ecaudit \"$@\"\n";
}

std::string Fish(const std::vector<CommandRow>& table) {
  std::string out =
      "# fish completion for ecaudit, written by 'ecaudit completion fish'\n"
      "complete -c ecaudit -n __fish_use_subcommand -f -a 'help version'\n"
      "complete -c ecaudit -s h -l help -d 'This page'\n";
  for (const CommandRow& command : table) {
    out += "complete -c ecaudit -n __fish_use_subcommand -f -a " + command.name + " -d " +
           ShellQuoted(command.summary) + "\n";
    for (const OptionSet::Row& row : command.options) {
      const std::string list = WordsOf(row);
      std::string line = "complete -c ecaudit -n " + ShellQuoted("__fish_seen_subcommand_from " + command.name);
      if (row.argument) {
        if (!list.empty()) out += line + " -f -a " + ShellQuoted(list) + "\n";
        continue;
      }
      for (const std::string& name : NamesOf(row)) {
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (!row.value.empty()) line += list.empty() ? " -r" : " -x -a " + ShellQuoted(list);
      out += line + " -d " + ShellQuoted(row.help) + "\n";
    }
  }
  return out;
}

}  // namespace

std::string CompletionScript(std::string_view shell) {
  const std::vector<CommandRow> table = CommandTable();
  if (shell == "bash") return Bash(table);
  if (shell == "zsh") return Zsh(table);
  if (shell == "fish") return Fish(table);
  return {};
}

}  // namespace ecaudit::cli
