/// Finds a phrase (two words or more, or a name with a dot) in any row of a profile file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cli/lookup/meaning.h"

namespace ecaudit::device {
class ProfileRegistry;
}

namespace ecaudit::cli::lookup {

/// One row: an object of the file with a source. What has rows of its own is not part of it.
struct ProfileFact {
  std::string path;                                        ///< "sync.cycle_count"
  std::vector<std::pair<std::string, std::string>> parts;  ///< key and value, lists joined
  std::string note;
  std::string source;
};

/// All rows of the text of a profile, in the order of the file. Empty if it is no JSON.
[[nodiscard]] std::vector<ProfileFact> FactsOf(std::string_view profile_text);

/// Whether the text has `words` as whole words, in any case. "F28" is not in "F281", "PTBASE" is in "PTBASE = 1".
[[nodiscard]] bool HasWords(std::string_view text, std::string_view words);

/// Adds what the manuals of the families mention by that phrase, or by a name with a dot; single words are too many.
/// What `out` cites already is left out.
void AddMentions(std::string_view what, const Families& families, const device::ProfileRegistry& registry,
                 std::vector<Meaning>& out);

}  // namespace ecaudit::cli::lookup
