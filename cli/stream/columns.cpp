#include "cli/stream/columns.h"

#include "cli/stream/json_line.h"

namespace ecaudit::cli {
namespace {

void AppendStyled(std::string& out, std::string_view text, report::Style style, bool color) {
  if (!color || style == report::Style::kPlain || text.empty()) {
    out += text;
  } else {
    out += report::TextBuilder(true).Styled(text, style);
  }
}

void Pad(std::string& out, std::string_view text, std::size_t width) {
  const std::size_t columns = report::Columns(text);
  if (columns < width) out.append(width - columns, ' ');
}

}  // namespace

std::string SecondsText(std::optional<std::int64_t> ns) {
  std::string text;
  if (ns) {
    AppendSeconds(text, *ns);
  } else {
    text = "-";
  }
  return text;
}

std::string_view TimeColumn::title() const {
  return mode == report::TimeMode::kRelative ? "time s" : mode == report::TimeMode::kUtc ? "time UTC" : "local time";
}

std::string TimeColumn::Text(const FrameRef& frame, std::optional<std::int64_t> since_start_ns) const {
  if (mode == report::TimeMode::kRelative) return SecondsText(since_start_ns);
  std::string text = report::MomentText(mode, origin, frame, 9);
  return text.empty() ? "-" : text;
}

std::string TimeColumn::Iso(const FrameRef& frame) const {
  if (mode == report::TimeMode::kRelative || !frame.has_time) return {};
  return mode == report::TimeMode::kUtc ? report::IsoTime(frame.time) : report::IsoLocalTime(frame.time);
}

void Columns::Gap() {
  if (!first_) out_ += "  ";
  first_ = false;
}

Columns& Columns::Left(std::string_view text, std::size_t width, report::Style style) {
  Gap();
  AppendStyled(out_, text, style, color_);
  Pad(out_, text, width);
  return *this;
}

Columns& Columns::Right(std::string_view text, std::size_t width, report::Style style) {
  Gap();
  Pad(out_, text, width);
  AppendStyled(out_, text, style, color_);
  return *this;
}

void Columns::Last(std::string_view text, report::Style style) {
  Gap();
  AppendStyled(out_, text, style, color_);
  while (!out_.empty() && out_.back() == ' ') out_.pop_back();
}

}  // namespace ecaudit::cli
