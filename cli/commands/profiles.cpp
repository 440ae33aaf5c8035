/// `ecaudit profiles [NAME]`: the drive families and what each one knows.
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/commands/catalogue_output.h"
#include "cli/commands/command.h"
#include "cli/commands/profile_page.h"
#include "cli/families.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {
namespace {

std::string ListText(bool color) {
  std::size_t width = 0;
  for (const std::string& name : device::BuiltinProfileNames()) width = std::max(width, name.size());
  report::TextBuilder text(color);
  for (const std::string& name : device::BuiltinProfileNames()) {
    const device::DeviceDescription* profile = device::BuiltinProfile(name);
    if (profile == nullptr) continue;
    const std::string padding(width - name.size() + 2, ' ');
    text.Line(text.Styled(name, report::Style::kBold) + padding + report::OneLine(profile->title));
  }
  text.Line();
  text.Line("ecaudit profiles NAME shows what a profile knows.");
  return text.Take();
}

void PutProfile(report::JsonObject& out, const device::DeviceDescription& profile) {
  out.Put("id", profile.id);
  out.Put("title", profile.title);
  out.Put("edition", profile.edition);
  out.Put("document", profile.document);
  out.Put("extends", profile.extends);
}

std::string ListJson() {
  return report::JsonDocumentText([](report::JsonObject& out) {
    out.Put("schema", "ecaudit.profiles/1");
    out.Array("profiles", [](report::JsonArray& profiles) {
      for (const std::string& name : device::BuiltinProfileNames()) {
        const device::DeviceDescription* profile = device::BuiltinProfile(name);
        if (profile == nullptr) continue;
        profiles.AddObject([profile](report::JsonObject& json) { PutProfile(json, *profile); });
      }
    });
  });
}

class ProfilesCommand : public Command {
 public:
  [[nodiscard]] std::string_view name() const override { return "profiles"; }
  [[nodiscard]] std::string_view usage() const override { return "profiles [NAME]"; }
  [[nodiscard]] std::string_view summary() const override {
    return "List the drive families, or what one of them knows";
  }

  void Declare(OptionSet& options) override {
    options.Argument("NAME", name_, "a profile; without it all are listed", false);
    options.Flag("--full", full_, "with NAME: also each object, emergency code and bit");
    output_.Declare(options);
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    if (!name_ && full_) {
      console.Error("--full needs the NAME of a profile (see 'ecaudit profiles')");
      return ExitStatus::kUsage;
    }
    if (!name_) return output_.Print(console, ListText, ListJson);
    const device::DeviceDescription* profile = device::BuiltinProfile(*name_);
    if (profile == nullptr) {
      return Fail(console, UnknownProfile(device::ProfileRegistry(), *name_));
    }
    return output_.Print(
        console, [this, profile](bool color) { return ProfileText(*profile, full_, color); },
        [profile] { return ProfileJson(*profile); });
  }

 private:
  std::optional<std::string> name_;
  bool full_ = false;
  CatalogueOutput output_;
};

}  // namespace

std::unique_ptr<Command> MakeProfilesCommand() {
  return std::make_unique<ProfilesCommand>();
}

}  // namespace ecaudit::cli
