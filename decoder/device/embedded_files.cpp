#include "decoder/device/embedded_files.h"

#include <QByteArray>
#include <QDir>
#include <QFile>
#include <QString>

// A static library does not register its resources by itself. The macro has to stand outside of all namespaces.
static void RegisterProfiles() {
  Q_INIT_RESOURCE(profiles);
}

namespace ecaudit::device {
namespace {

void RegisterOnce() {
  static const bool kRegistered = [] {
    RegisterProfiles();
    return true;
  }();
  static_cast<void>(kRegistered);
}

}  // namespace

std::vector<std::string> EmbeddedProfileNames() {
  RegisterOnce();
  std::vector<std::string> names;
  const QStringList files = QDir(QStringLiteral(":/ecaudit/profiles")).entryList(QDir::Files, QDir::Name);
  for (const QString& file : files) {
    if (file.endsWith(QStringLiteral(".json"))) names.push_back(file.chopped(5).toStdString());
  }
  return names;
}

std::string EmbeddedProfileText(std::string_view name) {
  RegisterOnce();
  const QString path = QStringLiteral(":/ecaudit/profiles/") +
                       QString::fromUtf8(name.data(), static_cast<qsizetype>(name.size())) + QStringLiteral(".json");
  QFile file(path);
  if (name.find('/') != std::string_view::npos || !file.open(QIODevice::ReadOnly)) return {};
  const QByteArray bytes = file.readAll();
  return std::string(bytes.constData(), static_cast<std::size_t>(bytes.size()));
}

}  // namespace ecaudit::device
