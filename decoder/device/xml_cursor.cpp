#include "decoder/device/xml_cursor.h"

#include <algorithm>
#include <charconv>

#include <QByteArray>
#include <QString>
#include <QStringConverter>
#include <QXmlStreamReader>

#include "decoder/base/text.h"

namespace ecaudit::device {
namespace {

QString FromUtf8(std::string_view text) {
  return QString::fromUtf8(text.data(), static_cast<qsizetype>(text.size()));
}

/// The encoding that the XML declaration names; empty when it names none.
std::string_view DeclaredEncoding(std::string_view xml) {
  const std::string_view head = xml.substr(0, 200);
  if (head.substr(0, 5) != "<?xml") return {};
  const std::string_view declaration = head.substr(0, head.find("?>"));
  const std::size_t at = declaration.find("encoding");
  if (at == std::string_view::npos) return {};
  const std::size_t open = declaration.find_first_of("\"'", at);
  if (open == std::string_view::npos) return {};
  const std::size_t close = declaration.find(declaration[open], open + 1);
  if (close == std::string_view::npos) return {};
  return declaration.substr(open + 1, close - open - 1);
}

/// True if an element has too many attributes for a search of duplicates in reasonable time: the parser compares
/// each with each. Also right where a character takes two bytes.
bool HasTooManyAttributes(std::string_view xml) {
  std::size_t at = 0;
  while ((at = xml.find('<', at)) != std::string_view::npos) {
    ++at;
    if (xml.substr(at, 3) == "!--") {
      at = std::min(xml.find("-->", at), xml.size());
      continue;
    }
    if (xml.substr(at, 8) == "![CDATA[") {
      at = std::min(xml.find("]]>", at), xml.size());
      continue;
    }
    std::size_t attributes = 0;
    char quote = 0;
    for (; at < xml.size() && (quote != 0 || xml[at] != '>'); ++at) {
      const char c = xml[at];
      if (quote != 0) {
        if (c == quote) quote = 0;
      } else if (c == '"' || c == '\'') {
        quote = c;
      } else if (c == '=' && ++attributes > kMaxXmlAttributes) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

struct XmlCursor::Parser {
  QXmlStreamReader reader;
};

XmlCursor::XmlCursor(std::string_view xml) : parser_(std::make_unique<Parser>()) {
  if (xml.size() > kMaxXmlBytes) {
    error_ = Error{"larger than " + Grouped(kMaxXmlBytes) + " bytes"};
    return;
  }
  if (HasTooManyAttributes(xml)) {
    error_ = Error{"an element has more than " + Grouped(kMaxXmlAttributes) + " attributes"};
    return;
  }
  const std::string encoding(DeclaredEncoding(xml));
  if (!encoding.empty() && !QStringConverter::encodingForName(encoding.c_str())) {
    // Windows code pages and the like, which Qt does not know: ASCII and most letters agree with Latin-1.
    parser_->reader.addData(QString::fromLatin1(xml.data(), static_cast<qsizetype>(xml.size())));
  } else {
    parser_->reader.addData(QByteArray::fromRawData(xml.data(), static_cast<qsizetype>(xml.size())));
  }
}

XmlCursor::~XmlCursor() = default;

void XmlCursor::Fail(std::string_view what) {
  if (error_) return;
  error_ = Error{"line " + std::to_string(parser_->reader.lineNumber()) + ", column " +
                 std::to_string(parser_->reader.columnNumber()) + ": " + std::string(what)};
}

std::uint32_t XmlCursor::line() const {
  return static_cast<std::uint32_t>(parser_->reader.lineNumber());
}

void XmlCursor::CheckParser() {
  if (parser_->reader.hasError()) Fail(Printable(parser_->reader.errorString().toStdString()));
}

void XmlCursor::EnterRoot(std::string_view name) {
  while (!failed() && !parser_->reader.atEnd()) {
    const QXmlStreamReader::TokenType token = parser_->reader.readNext();
    if (token == QXmlStreamReader::DTD) return Fail("document type declarations are not accepted");
    if (token != QXmlStreamReader::StartElement) continue;
    name_ = parser_->reader.name().toString().toStdString();
    if (name_ != name) Fail("expected the element " + std::string(name) + ", got " + Printable(name_));
    return;
  }
  CheckParser();
  Fail("there is no element");
}

bool XmlCursor::NextChild() {
  if (failed()) return false;
  const bool more = parser_->reader.readNextStartElement();
  CheckParser();
  if (!more || failed()) return false;
  name_ = parser_->reader.name().toString().toStdString();
  return true;
}

void XmlCursor::Children(std::initializer_list<XmlChild> listed) {
  while (NextChild()) {
    const auto* child = std::ranges::find(listed, std::string_view(name_), &XmlChild::name);
    if (child == listed.end()) {
      Skip();
    } else {
      child->Read(*this);
    }
  }
}

std::string XmlCursor::Text() {
  if (failed()) return {};
  const QString text = parser_->reader.readElementText(QXmlStreamReader::SkipChildElements);
  CheckParser();
  if (static_cast<std::size_t>(text.size()) > kMaxXmlText)
    Fail("text longer than " + Grouped(kMaxXmlText) + " characters");
  return failed() ? std::string() : text.trimmed().toStdString();
}

void XmlCursor::Skip() {
  if (failed()) return;
  parser_->reader.skipCurrentElement();
  CheckParser();
}

std::string XmlCursor::Attribute(std::string_view name) const {
  if (failed()) return {};
  return parser_->reader.attributes().value(FromUtf8(name)).toString().trimmed().toStdString();
}

bool XmlCursor::Flag(std::string_view name) const {
  const std::string text = Attribute(name);
  return text == "1" || text == "true" || text == "TRUE";
}

std::int64_t XmlCursor::Integer(std::string_view text, std::int64_t min, std::int64_t max) {
  if (failed()) return 0;
  const bool negative = !text.empty() && text[0] == '-';
  std::string_view digits = negative ? text.substr(1) : text;
  // "#x" is the form of the schema; some tools write "0x".
  const std::string_view prefix = digits.substr(0, 2);
  const bool hex = prefix == "#x" || prefix == "#X" || prefix == "0x" || prefix == "0X";
  if (hex) digits.remove_prefix(2);
  std::uint64_t magnitude = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, magnitude, hex ? 16 : 10);
  if (digits.empty() || stop != end || error != std::errc{} || magnitude > 0x7FFF'FFFF'FFFF'FFFFULL) {
    Fail("\"" + Printable(text) + "\" is not a number");
    return 0;
  }
  const auto value = static_cast<std::int64_t>(magnitude) * (negative ? -1 : 1);
  if (value < min || value > max) {
    Fail(std::to_string(value) + " is outside " + std::to_string(min) + " to " + std::to_string(max));
    return 0;
  }
  return value;
}

std::vector<std::uint8_t> XmlCursor::Bytes() {
  const std::string text = Text();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 2);
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    unsigned value = 0;
    const auto [stop, error] = std::from_chars(text.data() + i, text.data() + i + 2, value, 16);
    if (stop != text.data() + i + 2 || error != std::errc{}) break;
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  if (bytes.size() * 2 != text.size()) {
    Fail("\"" + Printable(text.substr(0, 40)) + "\" is not a row of hexadecimal bytes");
    bytes.clear();
  }
  return bytes;
}

}  // namespace ecaudit::device
