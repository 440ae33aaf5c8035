#include "samples/builder/catalogue.h"

#include <utility>

namespace ecaudit::samples {
namespace {

constexpr const char* kHead = R"(# Samples

Small captures to try `ecaudit`, to see its findings, and for its tests. None of them was recorded from a device: in
`samples/builder/` a scripted EtherCAT master runs against simulated slaves in virtual time and writes every packet. The
drive answers with the identity of a Kollmorgen AKD (vendor 0x6A, product 0x00414B44) and follows its public manual; its
timing is invented.

`ecaudit_make_samples samples` writes this file, `captures/` and `captures/expected.json` again with the same bytes.
`expected.json` lists the findings of severity error and warning that a correct report of each capture holds:

- `slave`: its position; null for the whole bus, or if the capture does not show which slave it is,
- `sent`, `returned`: the numbers of the two copies of the frame, absent if a copy is not in the file,
- `until`: a finding may cite a later frame instead, up to this one,
- `count`: repetitions folded into one finding, if relevant,
- `optional`: a consequence that a report may also leave to its cause.

To add a sample, see `builder/scenarios/scenario.h`.

| capture | packets | what happens | a correct report |
|---|---:|---|---|
)";

std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

}  // namespace

std::vector<MadeSample> MakeAll() {
  std::vector<MadeSample> made;
  for (const Scenario& scenario : AllScenarios()) made.push_back({&scenario, scenario.make()});
  return made;
}

std::string ReadmeText(const std::vector<MadeSample>& made) {
  std::string out = kHead;
  for (const MadeSample& one : made) {
    out += "| `" + one.file_name() + "` | " + std::to_string(one.sample.packets) + " | " + one.scenario->about + " | " +
           one.scenario->report + " |\n";
  }
  return out;
}

std::string ExpectedJson(const std::vector<MadeSample>& made) {
  std::string out = "{\n";
  for (const MadeSample& one : made) {
    out += (&one == made.data() ? "" : ",\n");
    out += "  " + Quoted(one.file_name()) + ": {\n    \"packets\": " + std::to_string(one.sample.packets) +
           ",\n    \"findings\": [";
    bool first = true;
    for (const Expectation& finding : one.sample.expected) {
      out += first ? "\n" : ",\n";
      first = false;
      out += "      {\"rule\": " + Quoted(finding.rule) +
             ", \"slave\": " + (finding.slave < 0 ? "null" : std::to_string(finding.slave));
      if (finding.sent != 0) out += ", \"sent\": " + std::to_string(finding.sent);
      if (finding.returned != 0) out += ", \"returned\": " + std::to_string(finding.returned);
      if (finding.until != 0) out += ", \"until\": " + std::to_string(finding.until);
      if (finding.count != 0) out += ", \"count\": " + std::to_string(finding.count);
      if (finding.optional) out += ", \"optional\": true";
      if (!finding.why.empty()) out += ", \"why\": " + Quoted(finding.why);
      out += "}";
    }
    out += first ? "]\n  }" : "\n    ]\n  }";
  }
  return out + "\n}\n";
}

}  // namespace ecaudit::samples
