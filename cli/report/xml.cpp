#include "cli/report/xml.h"

#include <QByteArray>
#include <QString>
#include <QXmlStreamWriter>

#include "cli/report/layout.h"

namespace ecaudit::report {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// U+FFFE or U+FFFF.
bool BeginsWithNoCharacter(std::string_view text) {
  return text.starts_with("\xEF\xBF\xBE") || text.starts_with("\xEF\xBF\xBF");
}

/// Characters that XML 1.0 has; markup characters are left to the writer.
QString XmlCharacters(std::string_view text) {
  QString out = QString::fromUtf8(text.data(), static_cast<qsizetype>(text.size()));
  for (QChar& c : out) {
    if (c.unicode() >= 0xFFFE) c = QChar::ReplacementCharacter;
  }
  return out;
}

QString XmlName(std::string_view name) {
  return QString::fromLatin1(name.data(), static_cast<qsizetype>(name.size()));
}

}  // namespace

std::string XmlText(std::string_view text) {
  const std::string printable = PrintableLines(text);
  std::string out;
  out.reserve(printable.size());
  for (std::size_t i = 0; i < printable.size(); ++i) {
    switch (const char c = printable[i]) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        if (BeginsWithNoCharacter(std::string_view(printable).substr(i))) {
          out += kReplacement;
          i += kReplacement.size() - 1;
        } else {
          out += c;
        }
    }
  }
  return out;
}

struct XmlWriter::Stream {
  QByteArray bytes;
  QXmlStreamWriter xml{&bytes};
};

XmlWriter::XmlWriter() : stream_(std::make_unique<Stream>()) {
  stream_->xml.setAutoFormatting(true);
  stream_->xml.setAutoFormattingIndent(2);
  stream_->xml.writeStartDocument();
}

XmlWriter::~XmlWriter() = default;

XmlWriter& XmlWriter::Begin(std::string_view name) {
  stream_->xml.writeStartElement(XmlName(name));
  return *this;
}

XmlWriter& XmlWriter::Attribute(std::string_view name, std::string_view value) {
  stream_->xml.writeAttribute(XmlName(name), XmlCharacters(OneLine(value)));
  return *this;
}

XmlWriter& XmlWriter::Attribute(std::string_view name, std::uint64_t value) {
  stream_->xml.writeAttribute(XmlName(name), QString::number(value));
  return *this;
}

XmlWriter& XmlWriter::Text(std::string_view text) {
  stream_->xml.writeCharacters(XmlCharacters(PrintableLines(text)));
  return *this;
}

XmlWriter& XmlWriter::End() {
  stream_->xml.writeEndElement();
  return *this;
}

std::string XmlWriter::Take() {
  stream_->xml.writeEndDocument();
  return stream_->bytes.toStdString();
}

}  // namespace ecaudit::report
