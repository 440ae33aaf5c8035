/// The tables made from the manuals, for comparison with the profiles.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/csv.h"
#include "tests/support/folders.h"

namespace ecaudit::device {

/// Which rows of the tables belong to which built-in profile.
struct Family {
  std::string_view profile;
  std::vector<std::string_view> rows;  ///< values of the column "family"
};

inline const std::vector<Family>& Families() {
  static const std::vector<Family> families = {{"kollmorgen-akd-2010", {"akd_b"}},
                                               {"kollmorgen-akd-2011", {"akd_d"}},
                                               {"kollmorgen-mkd-c", {"mkd", "mkd_c"}},
                                               {"kollmorgen-mkd-n", {"mkd", "mkd_n"}},
                                               {"pilz-pmcprotego-d", {"pilz"}}};
  return families;
}

inline std::vector<test::CsvRow> Table(std::string_view name) {
  return test::ReadCsvFile(test::SharedDir() + "/reference/" + std::string(name) + ".csv");
}

/// The rows of one family.
inline std::vector<test::CsvRow> Table(std::string_view name, const Family& family) {
  std::vector<test::CsvRow> rows;
  for (test::CsvRow& row : Table(name)) {
    for (const std::string_view wanted : family.rows) {
      if (row["family"] == wanted) rows.push_back(row);
    }
  }
  return rows;
}

/// "0x1A00" or "12"
inline std::uint64_t Number(const std::string& text) {
  return std::stoull(text, nullptr, 0);
}

/// Some cells point to other tables by file name; profiles say the same in words.
inline bool NamesATable(const std::string& cell) {
  return cell.find(".csv") != std::string::npos || cell.find("seed") != std::string::npos;
}

/// "001 §4.3.3" as the profiles cite it: "MKD, 4.3.3".
inline std::string CitationOf(const std::string& source) {
  std::string out;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const bool document = (i == 0 || source[i - 1] == ' ') && source.compare(i, 2, "00") == 0;
    if (document) {
      static const std::string_view kKeys[] = {"AKD-2010", "MKD", "PILZ", "AKD-2011", "AKD-UG"};
      out += kKeys[static_cast<std::size_t>(source[i + 2] - '0')];
      i += 2;
    } else if (source.compare(i, 3, " \xC2\xA7") == 0) {
      out += ", ";
      i += 2;
    } else {
      out += source[i];
    }
  }
  return out;
}

}  // namespace ecaudit::device

/// The tables are data to test with and no part of the project.
#define ECAUDIT_NEEDS_TABLE(name) \
  if (::ecaudit::device::Table(name).empty()) GTEST_SKIP() << "no reference table " << (name) << ".csv"
