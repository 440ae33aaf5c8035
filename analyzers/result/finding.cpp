#include "analyzers/result/finding.h"

#include <algorithm>

#include "decoder/device/source_documents.h"

namespace ecaudit {

Reference ReferenceTo(std::string_view source) {
  const device::Citation citation = device::FirstCitation(source);
  return {std::string(citation.key), std::string(citation.section)};
}

Finding Found(const FindingKind& kind, SlaveId slave, const FrameRef& first) {
  Finding finding;
  finding.kind = &kind;
  finding.slave = slave;
  finding.first = first;
  return finding;
}

bool Finding::Has(const NoteKind& note) const {
  return std::ranges::any_of(notes, [&](const Note& own) { return own.kind == &note; });
}

FrameNo BegunBy(const Finding& finding) {
  FrameNo first = finding.first.number;
  for (const FrameNo frame : finding.related_frames) first = std::min(first, frame);
  return first;
}

std::string IdentityOf(const Finding& finding) {
  std::string identity(finding.kind->name);
  if (finding.axis != 0) identity += " axis=" + std::to_string(finding.axis + 1);
  std::string_view names = finding.kind->identity;
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find(' '));
    names.remove_prefix(std::min(names.size(), name.size() + 1));
    const Value* value = finding.arguments.Find(name);
    if (value != nullptr) identity += " " + std::string(name) + "=" + KeyOf(*value);
  }
  return identity;
}

}  // namespace ecaudit
