#include "decoder/device/embedded_files.h"

#include <algorithm>

#include <QResource>
#include <QString>
#include <QStringList>

// A static library does not register its resources by itself. The macro has to stand outside of all namespaces.
static void RegisterProfiles() {
  Q_INIT_RESOURCE(profiles);
  Q_INIT_RESOURCE(packed_profiles);
}

namespace ecaudit::device {
namespace {

/// A resource whose entries may be listed.
class Folder : public QResource {
 public:
  using QResource::children;
  using QResource::QResource;
};

void RegisterOnce() {
  static const bool kRegistered = [] {
    RegisterProfiles();
    return true;
  }();
  static_cast<void>(kRegistered);
}

std::string_view Stored(const QString& folder, std::string_view name, const QString& extension) {
  RegisterOnce();
  if (name.find('/') != std::string_view::npos) return {};
  const QResource file(folder + QString::fromUtf8(name.data(), static_cast<qsizetype>(name.size())) + extension);
  // They are stored as they are (see CMakeLists.txt): to unpack them took longer than to read them.
  if (!file.isValid() || file.compressionAlgorithm() != QResource::NoCompression) return {};
  return {reinterpret_cast<const char*>(file.data()), static_cast<std::size_t>(file.size())};
}

}  // namespace

std::vector<std::string> EmbeddedProfileNames() {
  RegisterOnce();
  std::vector<std::string> names;
  const QStringList files = Folder(QStringLiteral(":/ecaudit/profiles")).children();
  for (const QString& file : files) {
    if (file.endsWith(QStringLiteral(".json"))) names.push_back(file.chopped(5).toStdString());
  }
  std::ranges::sort(names);
  return names;
}

std::string_view EmbeddedProfileText(std::string_view name) {
  return Stored(QStringLiteral(":/ecaudit/profiles/"), name, QStringLiteral(".json"));
}

std::string_view EmbeddedProfileCbor(std::string_view name) {
  return Stored(QStringLiteral(":/ecaudit/packed/"), name, QStringLiteral(".cbor"));
}

std::string_view EmbeddedHeadCbor(std::string_view name) {
  return Stored(QStringLiteral(":/ecaudit/packed/"), name, QStringLiteral(".head"));
}

std::string_view EmbeddedObjects(std::string_view name) {
  return Stored(QStringLiteral(":/ecaudit/packed/"), name, QStringLiteral(".objects"));
}

}  // namespace ecaudit::device
