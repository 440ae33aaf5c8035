#include "cli/settings_key.h"

#include <algorithm>
#include <optional>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/device_files.h"
#include "analyzers/options/options.h"
#include "analyzers/result/rule_info.h"
#include "cli/json_file.h"
#include "cli/report/fingerprint.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"
#include "cli/version.h"
#include "decoder/base/regular_file.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using report::JsonArray;
using report::JsonObject;

std::string HashText(std::string_view text) {
  return Hex(report::StableHash(text), 16).substr(2);
}

void AddFileNameAndHash(JsonArray& out, const std::string& path) {
  out.Add(path);
  out.Add(HashText(ReadRegularFile(path, kLargestReport).text));
}

/// Name and content of a file that settings name.
void PutFile(JsonObject& out, std::string_view key, const std::string& path) {
  if (path.empty()) return out.Put(key, nullptr);
  out.Array(key, [&](JsonArray& pair) { AddFileNameAndHash(pair, path); });
}

void AddSelectorParts(JsonArray& out, const SlaveSelector& slave) {
  out.Add(slave.by_address);
  out.Add(slave.value);
  if (!slave.name.empty()) out.Add(slave.name);
}

void AddSelector(JsonArray& out, const SlaveSelector& slave) {
  out.AddArray([&](JsonArray& parts) { AddSelectorParts(parts, slave); });
}

void AddSlaveProfile(JsonArray& out, const std::pair<SlaveSelector, std::string>& setting) {
  AddSelector(out, setting.first);
  out.Add(setting.second);
}

void AddGivenParameter(JsonArray& out, const GivenParameter& parameter) {
  if (parameter.slave) {
    AddSelector(out, *parameter.slave);
  } else {
    out.Add(nullptr);
  }
  out.Add(parameter.keyword);
  out.Add(parameter.value);
}

void AddRange(JsonArray& out, const AnalysisOptions& analysis) {
  out.Add(analysis.from_s);
  out.Add(analysis.to_s);
  out.Add(analysis.from_frame);
  out.Add(analysis.to_frame);
  for (const std::uint16_t interface : analysis.interfaces) out.Add(interface);
}

/// An array with an array for each of `items`, which `add` fills; left out when there are none.
template <typename Item>
void PutRows(JsonObject& out, std::string_view key, const std::vector<Item>& items,
             void (*add)(JsonArray&, const Item&)) {
  if (items.empty()) return;
  out.Array(key, [&](JsonArray& rows) {
    for (const Item& item : items) {
      rows.AddArray([&](JsonArray& row) { add(row, item); });
    }
  });
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
  report::JsonText text(report::JsonText::Layout::kLine);
  // By the alphabet: the hashes that reports already hold were made so.
  text.Object([&](JsonObject& key) {
    PutFile(key, "baseline", settings.baseline);
    key.Put("catalogue", catalogue);
    key.Put("config", settings.config);
    if (analysis.slave_names.from_one) key.Put("count_from", 1U);
    key.Put("default_profile", analysis.default_profile);
    PutFile(key, "eni", settings.eni.value_or(""));
    PutRows(key, "esi", settings.esi, AddFileNameAndHash);
    if (analysis.files && !analysis.files->families.own().empty()) {
      key.Object("families", [&](JsonObject& families) {
        for (const auto& [id, own] : analysis.files->families.own()) families.Put(id, HashText(own.text));
      });
    }
    key.Put("fail_on", Name(settings.fail_on));
    if (!analysis.limits.empty()) {
      key.Object("limits", [&](JsonObject& limits) {
        for (const auto& [name, limit] : analysis.limits) limits.Put(name, limit);
      });
    }
    if (!settings.moments.text.empty()) key.Put("moments", settings.moments.text);
    PutRows(key, "parameters", analysis.parameters, AddGivenParameter);
    if (!settings.isolated_by.empty()) key.Put("isolated_by", settings.isolated_by);
    key.Array("range", [&](JsonArray& range) { AddRange(range, analysis); });
    if (settings.required.any()) key.Put("required", settings.required.text);
    key.Array("rules", [&](JsonArray& rules) {
      for (const auto& setting : RuleSettingTexts(analysis)) {
        rules.AddArray([&](JsonArray& row) {
          row.Add(setting.first);
          row.Add(setting.second);
        });
      }
    });
    PutRows(key, "slave_profiles", analysis.slave_profiles, AddSlaveProfile);
    PutRows(key, "slaves", settings.slaves, AddSelectorParts);
    key.Put("version", Version());
  });
  return HashText(text.Take());
}

report::Origin OriginOf(std::span<const std::string> files, const std::string& settings_key) {
  std::uint64_t bytes = 0;
  TimeNs modified = 0;
  for (const std::string& file : files) {
    const std::optional<system::FileStatus> status = system::StatusOf(file);
    if (!status) continue;
    bytes += status->bytes;
    modified = std::max(modified, TimeNs{status->modified_ns});
  }
  return {settings_key, bytes, report::IsoTime(modified)};
}

}  // namespace ecaudit::cli
