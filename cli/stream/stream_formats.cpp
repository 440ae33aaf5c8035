#include "cli/stream/stream_formats.h"

#include <array>

namespace ecaudit::cli {

StreamFormats::StreamFormats(bool (*has_sink)(const StreamFormat&)) {
  const std::array all{
      TextFormat(),
      CsvFormat(),
      JsonLinesFormat(),
  };
  for (const StreamFormat& format : all) {
    if (!has_sink(format)) continue;
    formats_.push_back(format);
    outputs_.push_back(format.output);
  }
}

const StreamFormats& StreamFormats::OfSignals() {
  static const StreamFormats kFormats([](const StreamFormat& format) { return format.signals != nullptr; });
  return kFormats;
}

const StreamFormats& StreamFormats::OfEvents() {
  static const StreamFormats kFormats([](const StreamFormat& format) { return format.events != nullptr; });
  return kFormats;
}

const StreamFormats& StreamFormats::OfDatagrams() {
  static const StreamFormats kFormats([](const StreamFormat& format) { return format.datagrams != nullptr; });
  return kFormats;
}

std::string StreamFormats::Help() const {
  std::string help;
  for (std::size_t i = 0; i < formats_.size(); ++i) {
    help += i == 0 ? "" : i + 1 < formats_.size() ? ", " : " or ";
    help += formats_[i].help;
    if (i == 0) help += " (default)";
  }
  return help;
}

}  // namespace ecaudit::cli
