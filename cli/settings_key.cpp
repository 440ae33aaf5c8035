#include "cli/settings_key.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "analyzers/result/rule_info.h"
#include "cli/report/fingerprint.h"
#include "cli/report/times.h"
#include "cli/version.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using Json = nlohmann::json;

std::string HashText(std::string_view text) {
  return Hex(report::StableHash(text), 16).substr(2);
}

/// Name and content of a file that settings name.
Json FileKey(const std::string& path) {
  if (path.empty()) return nullptr;
  std::ifstream file(path, std::ios::binary);
  return {path, HashText(std::string((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>()))};
}

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json SelectorKey(const SlaveSelector& slave) {
  return {slave.by_address, slave.value};
}

std::string CatalogueHash() {
  std::string text;
  for (const RuleInfo* rule : RuleCatalogue()) {
    for (const std::string_view part : {rule->id, Name(rule->severity), rule->title, rule->needs, rule->doc}) {
      text.append(part).push_back('\0');
    }
  }
  return HashText(text);
}

}  // namespace

std::string SettingsKey(const Settings& settings) {
  static const std::string catalogue = CatalogueHash();
  const AnalysisOptions& analysis = settings.analysis;
  Json key;
  key["version"] = Version();
  key["catalogue"] = catalogue;
  key["default_profile"] = analysis.default_profile;
  for (const auto& [slave, profile] : analysis.slave_profiles) {
    key["slave_profiles"].push_back({SelectorKey(slave), profile});
  }
  for (const GivenParameter& parameter : analysis.parameters) {
    key["parameters"].push_back(
        {parameter.slave ? SelectorKey(*parameter.slave) : Json(nullptr), parameter.keyword, parameter.value});
  }
  key["rules"] = RuleSettingTexts(analysis);
  key["range"] = {OrNull(analysis.from_s), OrNull(analysis.to_s), OrNull(analysis.from_frame),
                  OrNull(analysis.to_frame)};
  for (const auto& [name, limit] : analysis.limits) key["limits"][name] = limit;
  for (const SlaveSelector& slave : settings.slaves) key["slaves"].push_back(SelectorKey(slave));
  key["fail_on"] = Name(settings.fail_on);
  key["config"] = settings.config;
  key["baseline"] = FileKey(settings.baseline);
  for (const std::string& file : settings.esi) key["esi"].push_back(FileKey(file));
  key["eni"] = FileKey(settings.eni.value_or(""));
  // Paths may hold bytes that are no UTF-8.
  return HashText(key.dump(-1, ' ', false, Json::error_handler_t::replace));
}

report::Origin OriginOf(std::span<const std::string> files, const std::string& settings_key) {
  std::uint64_t bytes = 0;
  TimeNs modified = 0;
  for (const std::string& file : files) {
    struct stat info {};
    if (stat(file.c_str(), &info) != 0) continue;
    bytes += static_cast<std::uint64_t>(info.st_size);
    modified = std::max(modified, static_cast<TimeNs>(info.st_mtim.tv_sec) * 1'000'000'000 + info.st_mtim.tv_nsec);
  }
  return {settings_key, bytes, report::IsoTime(modified)};
}

}  // namespace ecaudit::cli
