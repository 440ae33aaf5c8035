/// The libraries that read captures, as they are at run time.
#pragma once

#include <string>

namespace ecaudit::capture {

/// "libpcap 1.10.3, zlib 1.2.13, zstd 1.5.4".
[[nodiscard]] std::string LibraryVersions();

}  // namespace ecaudit::capture
