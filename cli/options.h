/// Command lines. CLI11 is known to options.cpp only; commands declare what they take through OptionSet.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ecaudit::cli {

class Command;

/// The options and arguments of one command. Targets must outlive parsing; they keep their value when not given.
class OptionSet {
 public:
  explicit OptionSet(std::string_view command, std::string_view summary);
  ~OptionSet();
  OptionSet(const OptionSet&) = delete;
  OptionSet& operator=(const OptionSet&) = delete;

  /// Options declared from here on stand under this heading in the help.
  void Group(std::string heading);
  /// An option without value, for example "--join".
  void Flag(const std::string& names, bool& target, const std::string& help);
  /// An option with one value; the last one counts when it is given more than once.
  void Value(const std::string& names, const std::string& value_name, std::optional<std::string>& target,
             const std::string& help);
  /// An option that may be given several times.
  void Values(const std::string& names, const std::string& value_name, std::vector<std::string>& target,
              const std::string& help);
  /// One positional argument; `required` or not.
  void Argument(const std::string& name, std::optional<std::string>& target, const std::string& help, bool required);
  /// One or more positional arguments: paths. What the shell leaves of wildcards becomes files.
  void Arguments(const std::string& name, std::vector<std::string>& target, const std::string& help);
  /// The words that can follow the option, or stand for the argument, that was declared last: for completion.
  void Words(std::vector<std::string> words);
  /// Likewise words that take time to find: they are asked for where they are needed.
  void Words(std::function<std::vector<std::string>()> words);
  /// Text below the options in the help.
  void Footer(const std::string& text);

  /// A line of the help, for man pages and completion.
  struct Row {
    std::string names;  ///< "-o,--output"; of an argument "CAPTURE"
    std::string value;  ///< "PATH"; empty for a flag and for arguments
    std::string help;
    std::string group;  ///< its heading; empty: "Options"
    bool argument = false;
    bool required = false;
    bool repeatable = false;
    std::function<std::vector<std::string>()> words = {};  ///< all that it takes; unset: a file, or anything
  };
  /// In the order in which they were declared.
  [[nodiscard]] const std::vector<Row>& rows() const;
  [[nodiscard]] const std::string& footer() const;

  enum class Outcome { kParsed, kHelp, kError };
  struct Parsed {
    Outcome outcome = Outcome::kParsed;
    std::string text;  ///< the help, or one line with what is wrong
  };
  /// @param arguments  what follows the command's name
  [[nodiscard]] Parsed Parse(const std::vector<std::string>& arguments);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The page of `ecaudit --help`.
[[nodiscard]] std::string ProgramHelp(const std::vector<std::unique_ptr<Command>>& commands);

}  // namespace ecaudit::cli
