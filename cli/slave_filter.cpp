#include "cli/slave_filter.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/capture_advice.h"
#include "cli/finding_filter.h"
#include "cli/report/digest.h"
#include "cli/report/layout.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {

bool Selects(const SlaveSelector& selector, const SlaveSummary& slave) {
  if (!selector.name.empty()) {
    // Names come from the device, with blanks at their end and letters in any case.
    const std::string name = report::OneLine(slave.name);
    return std::ranges::equal(name, selector.name, [](char a, char b) {
      return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
    });
  }
  if (selector.by_address) return slave.station_address == selector.value;
  return slave.position == selector.value || (selector.or_address != 0 && slave.station_address == selector.or_address);
}

std::string SlavesThere(const AnalysisResult& result) {
  constexpr std::size_t kNamed = 8;
  constexpr std::string_view kPrefix = "slave ";
  std::string there;
  for (std::size_t i = 0; i < result.slaves.size() && i < kNamed; ++i) {
    const SlaveSummary& slave = result.slaves[i];
    const std::string label = report::SlaveLabel(result.slave_names, slave.position, report::PrintableLines(slave.name),
                                                 slave.station_address);
    there += (there.empty() ? "" : ", ") + label.substr(kPrefix.size());
  }
  if (result.slaves.size() > kNamed) there += " and " + std::to_string(result.slaves.size() - kNamed) + " more";
  return there;
}

std::string NameOf(const SlaveSelector& selector, const SlaveNames& names) {
  if (!selector.name.empty()) return selector.name;
  return selector.by_address ? Hex(selector.value) : names.Number(selector.value);
}

std::vector<std::string> MissingSlaves(std::span<const SlaveSelector> selectors, const AnalysisResult& result) {
  std::vector<std::string> missing;
  for (const SlaveSelector& selector : selectors) {
    if (std::ranges::none_of(result.slaves, [&](const SlaveSummary& slave) { return Selects(selector, slave); })) {
      missing.push_back(NameOf(selector, result.slave_names));
    }
  }
  return missing;
}

std::vector<std::string> UnmetSlaves(const AnalysisOptions& options, const AnalysisResult& result) {
  std::vector<std::string> unmet;
  const auto look = [&](const SlaveSelector& selector) {
    if (std::ranges::any_of(result.slaves, [&](const SlaveSummary& slave) { return Selects(selector, slave); })) {
      return;
    }
    std::string name = NameOf(selector, result.slave_names);
    if (std::ranges::find(unmet, name) == unmet.end()) unmet.push_back(std::move(name));
  };
  for (const auto& [selector, profile] : options.slave_profiles) look(selector);
  for (const GivenParameter& parameter : options.parameters) {
    if (parameter.slave) look(*parameter.slave);
  }
  return unmet;
}

std::size_t KeepSlaves(std::span<const SlaveSelector> selectors, AnalysisResult& result) {
  if (selectors.empty()) return result.slaves.size();
  const auto selected = [&](SlaveId id) {
    const SlaveSummary* slave = result.slave(id);
    return slave == nullptr ||
           std::ranges::any_of(selectors, [&](const SlaveSelector& selector) { return Selects(selector, *slave); });
  };

  const std::vector<Finding>& findings = result.findings;
  std::vector<bool> keep(findings.size());
  for (std::size_t i = 0; i < findings.size(); ++i) keep[i] = selected(findings[i].slave);
  AddCauses(findings, keep);
  KeepFindings(keep, result);
  std::erase_if(result.not_evaluable, [&](const NotEvaluable& entry) { return !selected(entry.slave); });
  for (RuleCoverage& rule : result.coverage) {
    std::erase_if(rule.slaves, [&](const SlaveCoverage& entry) { return !selected(entry.slave); });
  }

  // Slaves that a kept cause belongs to stay, so that the finding keeps its position and name.
  const auto cited = [&](SlaveId id) {
    return std::ranges::any_of(findings, [id](const Finding& f) { return f.slave == id; });
  };
  std::size_t matching = 0;
  std::vector<SlaveSummary> kept_slaves;
  for (SlaveSummary& slave : result.slaves) {
    const bool named =
        std::ranges::any_of(selectors, [&](const SlaveSelector& selector) { return Selects(selector, slave); });
    if (named) ++matching;
    if (named || cited(slave.id)) kept_slaves.push_back(std::move(slave));
  }
  result.slaves = std::move(kept_slaves);
  result.capture_next = WhatToCaptureNext(result);
  return matching;
}

}  // namespace ecaudit::cli
