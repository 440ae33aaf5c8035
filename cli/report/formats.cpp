#include "cli/report/formats.h"

#include <array>

#include "cli/report/digest.h"
#include "cli/report/github_writer.h"
#include "cli/report/gitlab_writer.h"
#include "cli/report/html_writer.h"
#include "cli/report/index_page.h"
#include "cli/report/json_writer.h"
#include "cli/report/junit_writer.h"
#include "cli/report/markdown_writer.h"
#include "cli/report/sarif_writer.h"
#include "cli/report/summary_writer.h"

namespace ecaudit::report {
namespace {

std::string WriteJsonPlain(const Report& report, const TextStyle& /*style*/) {
  return WriteJson(report);
}

std::string WriteJunitOf(const Report& report, const TextStyle& /*style*/) {
  return WriteJunit(DigestOf(report));
}

std::string WriteSarifOf(const Report& report, const TextStyle& style) {
  return WriteSarif(DigestOf(report), style.folder);
}

std::string WriteGithubOf(const Report& report, const TextStyle& style) {
  return WriteGithub(DigestOf(report), style.folder);
}

std::string WriteGitlabOf(const Report& report, const TextStyle& style) {
  return WriteGitlab(DigestOf(report), style.folder);
}

std::string WriteMarkdownOf(const Report& report, const TextStyle& /*style*/) {
  return WriteMarkdown(DigestOf(report));
}

std::string WriteMarkdownPlain(const Digest& digest, const TextStyle& /*style*/) {
  return WriteMarkdown(digest);
}

std::string WriteSummaryJsonPlain(const Digest& digest, const TextStyle& /*style*/) {
  return WriteSummaryJson(digest);
}

std::string WriteJunitPlain(const Digest& digest, const TextStyle& /*style*/) {
  return WriteJunit(digest);
}

std::string WriteSarifPlain(const Digest& digest, const TextStyle& style) {
  return WriteSarif(digest, style.folder);
}

std::string WriteGithubPlain(const Digest& digest, const TextStyle& style) {
  return WriteGithub(digest, style.folder);
}

std::string WriteGitlabPlain(const Digest& digest, const TextStyle& style) {
  return WriteGitlab(digest, style.folder);
}

std::string WriteHtmlPlain(const Report& report, const TextStyle& /*style*/) {
  return WriteHtml(report);
}

constexpr std::array kFormats{
    Format{"text", ".txt", &WriteText, &WriteSummaryText},
    Format{"json", ".json", &WriteJsonPlain, &WriteSummaryJsonPlain, false, nullptr, true, &WriteJson},
    Format{"html", ".html", &WriteHtmlPlain, &WriteIndexPage, true, &MissingHtml, true},
    Format{"junit", ".xml", &WriteJunitOf, &WriteJunitPlain},
    Format{"sarif", ".sarif", &WriteSarifOf, &WriteSarifPlain, false, nullptr, true},
    Format{"github", ".github", &WriteGithubOf, &WriteGithubPlain, false, nullptr, true},
    Format{"markdown", ".md", &WriteMarkdownOf, &WriteMarkdownPlain},
    Format{"gitlab", ".gitlab", &WriteGitlabOf, &WriteGitlabPlain, false, nullptr, true},
};

}  // namespace

std::span<const Format> Formats() {
  return kFormats;
}

std::vector<Format> SummaryFormats() {
  std::vector<Format> formats;
  for (const Format& format : kFormats) {
    if (format.write_summary != nullptr) formats.push_back(format);
  }
  return formats;
}

std::string FormatList(std::span<const Format> formats) {
  std::string list = std::string(formats.front().name) + " (default)";
  for (std::size_t i = 1; i < formats.size(); ++i) {
    list += (i + 1 == formats.size() ? " or " : ", ") + std::string(formats[i].name);
  }
  return list;
}

}  // namespace ecaudit::report
