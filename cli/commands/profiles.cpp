/// `ecaudit profiles [NAME]`: the drive families and what each one knows; checks and begins files of families.
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/command_files.h"
#include "cli/commands/catalogue_output.h"
#include "cli/commands/command.h"
#include "cli/commands/profile_beginning.h"
#include "cli/commands/profile_page.h"
#include "cli/families.h"
#include "cli/output_file.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"
#include "decoder/device/description_file.h"
#include "decoder/device/esi_reader.h"
#include "decoder/device/profile_check.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {
namespace {

constexpr std::uintmax_t kMaxProfileBytes = 16U << 20U;

std::string ListText(const device::ProfileRegistry& families, bool color) {
  const std::vector<std::string> names = families.Names();
  std::size_t width = 0;
  for (const std::string& name : names) width = std::max(width, name.size());
  report::TextBuilder text(color);
  for (const std::string& name : names) {
    const device::DeviceDescription* profile = families.Find(name);
    if (profile == nullptr) continue;
    const std::string padding(width - name.size() + 2, ' ');
    const auto own = families.own().find(name);
    const std::string from = own == families.own().end() ? "" : " (" + report::OneLine(own->second.path) + ")";
    text.Line(text.Styled(report::OneLine(name), report::Style::kBold) + padding + report::OneLine(profile->title) +
              from);
  }
  text.Line();
  text.Line("ecaudit profiles NAME shows a profile; docs/families.md explains how to add one.");
  return text.Take();
}

void PutProfile(report::JsonObject& out, const device::DeviceDescription& profile,
                const device::ProfileRegistry& families) {
  out.Put("id", profile.id);
  out.Put("title", profile.title);
  out.Put("edition", profile.edition);
  out.Put("document", profile.document);
  out.Put("extends", profile.extends);
  const auto own = families.own().find(profile.id);
  if (own == families.own().end()) {
    out.Put("path", nullptr);
  } else {
    out.Text("path", own->second.path);
  }
}

std::string ListJson(const device::ProfileRegistry& families) {
  return report::JsonDocumentText([&](report::JsonObject& out) {
    out.Put("schema", "ecaudit.profiles/1");
    out.Array("profiles", [&](report::JsonArray& profiles) {
      for (const std::string& name : families.Names()) {
        const device::DeviceDescription* profile = families.Find(name);
        if (profile == nullptr) continue;
        profiles.AddObject([&](report::JsonObject& json) { PutProfile(json, *profile, families); });
      }
    });
  });
}

/// A file that was checked.
struct Checked {
  std::string path;
  std::vector<device::ProfileProblem> problems;
};

/// FILE:LINE: as compilers write it, so that editors find the place.
std::string ChecksText(const std::vector<Checked>& files) {
  std::string text;
  for (const Checked& file : files) {
    const std::string path = report::OneLine(file.path);
    for (const device::ProfileProblem& problem : file.problems) {
      text += path + ":" + std::to_string(problem.line) + ": ";
      if (!problem.place.empty()) text += report::OneLine(problem.place) + ": ";
      text += report::OneLine(problem.what) + "\n";
    }
    text += path + ": " + (file.problems.empty() ? "no mistake found" : Count(file.problems.size(), "mistake")) + "\n";
  }
  return text;
}

std::string ChecksJson(const std::vector<Checked>& files) {
  return report::JsonDocumentText([&](report::JsonObject& out) {
    out.Put("schema", "ecaudit.profile-check/1");
    out.List("files", files, [](report::JsonObject& json, const Checked& file) {
      json.Text("path", file.path);
      json.List("problems", file.problems, [](report::JsonObject& row, const device::ProfileProblem& problem) {
        row.Put("line", problem.line);
        row.Text("place", problem.place);
        row.Text("what", problem.what);
      });
    });
  });
}

bool IsProfileName(std::string_view name) {
  return !name.empty() &&
         std::ranges::all_of(name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; });
}

class ProfilesCommand : public Command {
 public:
  ProfilesCommand()
      : Command("profiles", "profiles [NAME]", "List the drive families or show one; check or create a family file") {}

  void Declare(OptionSet& options) override {
    options.Argument("NAME", name_, "a profile; without it all are listed", false);
    options.Words(device::BuiltinProfileNames());
    options.Flag("--full", full_, "with NAME: also each object, emergency code and bit");
    options.Values("--profiles", "PATH", paths_, "more drive families: a JSON file or a folder of them (repeatable)");
    output_.Declare(options);
    options.Group("Files of families (docs/families.md)");
    options.Values("--check", "FILE", check_,
                   "list all mistakes in this file with their lines; exit 1 if there is one (repeatable)");
    options.Value("--new", "NAME", new_, "create a family file: on standard output, or -o FILE");
    options.Value("--from", "FAMILY", from_, "with --new: the family that it extends (default: generic)");
    options.Words(device::BuiltinProfileNames());
    options.Value("--esi", "FILE", esi_, "with --new: take identity, PDOs, objects, mailboxes and DC modes from there");
    options.Value("--product", "CODE", product_, "with --esi: the device, where the file has several");
    options.Value("-o,--output", "FILE", file_, "with --new: write to FILE; an existing file is kept");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    if (!name_ && full_) return Fail(console, Error{"--full needs the NAME of a profile (see 'ecaudit profiles')"});
    if (name_.has_value() + !check_.empty() + new_.has_value() > 1) {
      return Fail(console, Error{"give one of NAME, --check and --new"});
    }
    if (!new_ && (from_ || esi_ || product_ || file_)) {
      return Fail(console, Error{"--from, --esi, --product and -o belong to --new NAME"});
    }
    const Result<device::ProfileRegistry> families = LoadFamilies(paths_);
    if (!families) return Fail(console, families.error());
    if (!check_.empty()) return CheckFiles(console, *families);
    if (new_) return Begin(console, *families);
    if (!name_) {
      return output_.Print(
          console, [&](bool color) { return ListText(*families, color); }, [&] { return ListJson(*families); });
    }
    const device::DeviceDescription* profile = families->Find(*name_);
    if (profile == nullptr) return Fail(console, UnknownProfile(*families, *name_));
    return output_.Print(
        console, [&](bool color) { return ProfileText(*profile, full_, color); },
        [&] { return ProfileJson(*profile, *families); });
  }

 private:
  [[nodiscard]] ExitStatus CheckFiles(Console& console, const device::ProfileRegistry& families) const {
    std::vector<Checked> files;
    bool clean = true;
    for (const std::string& path : check_) {
      // The name of a family is as good as its file.
      std::string text = system::Exists(path) ? std::string() : families.Text(path);
      if (text.empty()) {
        Result<std::string> read = device::ReadDescriptionFile(path, kMaxProfileBytes);
        if (!read) return Fail(console, read.error());
        text = std::move(*read);
      }
      files.push_back({path, device::CheckProfile(text, [&](std::string_view id) { return families.Find(id); })});
      clean = clean && files.back().problems.empty();
    }
    const ExitStatus printed = output_.Print(
        console, [&](bool /*color*/) { return ChecksText(files); }, [&] { return ChecksJson(files); });
    return printed == ExitStatus::kClean && !clean ? ExitStatus::kFindings : printed;
  }

  [[nodiscard]] ExitStatus Begin(Console& console, const device::ProfileRegistry& families) const {
    if (!IsProfileName(*new_)) {
      return Fail(console, Error{"--new is '" + *new_ + "' but a name has lower-case letters, digits and - only"});
    }
    ProfileBeginning wish{*new_, from_.value_or("generic"), nullptr, {}};
    if (families.Find(wish.extends) == nullptr) return Fail(console, UnknownProfile(families, wish.extends));
    device::EsiFile esi;
    if (esi_) {
      Result<device::EsiFile> read = device::LoadEsiFile(*esi_);
      if (!read) return Fail(console, read.error());
      esi = std::move(*read);
      Result<const device::DeviceDescription*> device = DeviceOf(esi);
      if (!device) return Fail(console, device.error());
      wish.esi = *device;
      wish.esi_file = std::filesystem::path(*esi_).filename().string();
    }
    const std::string text = ProfileBeginningText(wish);
    if (!file_ || *file_ == "-") {
      if (const auto error = console.Write(text)) return Fail(console, *error);
      return ExitStatus::kClean;
    }
    CommandFiles files;
    if (esi_) files.Reads(*esi_, kEsiRole);
    if (auto error = files.Writes(*file_)) return Fail(console, *error);
    if (system::Exists(*file_)) {
      return Fail(console, Error{Printable(*file_) + " exists and may hold work; it will not be overwritten"});
    }
    if (auto error = WriteOutputFile(*file_, text)) return Fail(console, *error);
    return ExitStatus::kClean;
  }

  /// The device of --product, or the only one; of several revisions the highest.
  [[nodiscard]] Result<const device::DeviceDescription*> DeviceOf(const device::EsiFile& esi) const {
    std::map<std::uint32_t, std::string> products;
    for (const device::DeviceDescription& device : esi.devices) {
      for (const std::uint32_t code : device.match.product_codes) products.emplace(code, device.title);
    }
    if (products.empty()) return Error{Printable(*esi_) + ": describes no device with a product code"};
    std::string list;
    for (const auto& [code, title] : products) {
      list += (list.empty() ? "" : ", ") + Hex(code, 8) + " (" + report::OneLine(title) + ")";
      const bool wanted = product_
                              ? *product_ == Hex(code, 8) || *product_ == Hex(code) || *product_ == std::to_string(code)
                              : products.size() == 1;
      if (wanted) return esi.Find(code, 0xFFFF'FFFF);
    }
    const std::string problem = product_ ? "has no product " + *product_ : "describes several products: give --product";
    return Error{Printable(*esi_) + ": " + problem + "; it has " + list};
  }

  std::optional<std::string> name_;
  bool full_ = false;
  std::vector<std::string> paths_;
  std::vector<std::string> check_;
  std::optional<std::string> new_;
  std::optional<std::string> from_;
  std::optional<std::string> esi_;
  std::optional<std::string> product_;
  std::optional<std::string> file_;
  CatalogueOutput output_;
};

}  // namespace

std::unique_ptr<Command> MakeProfilesCommand() {
  return std::make_unique<ProfilesCommand>();
}

}  // namespace ecaudit::cli
