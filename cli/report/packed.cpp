#include "cli/report/packed.h"

#include <QByteArray>
#include <zlib.h>

namespace ecaudit::report {

std::string Packed(std::string_view text) {
  uLongf size = compressBound(static_cast<uLong>(text.size()));
  QByteArray bytes(static_cast<qsizetype>(size), Qt::Uninitialized);
  const int status = compress2(reinterpret_cast<Bytef*>(bytes.data()), &size,
                               reinterpret_cast<const Bytef*>(text.data()), static_cast<uLong>(text.size()), 6);
  if (status != Z_OK) return {};
  bytes.resize(static_cast<qsizetype>(size));
  return bytes.toBase64().toStdString();
}

}  // namespace ecaudit::report
