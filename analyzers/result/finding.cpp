#include "analyzers/result/finding.h"

#include "decoder/device/source_documents.h"

namespace ecaudit {

Reference ReferenceTo(std::string_view source) {
  const device::Citation citation = device::FirstCitation(source);
  return {std::string(citation.key), std::string(citation.section)};
}

}  // namespace ecaudit
