#include "decoder/base/system/locks.h"
#include "decoder/base/system/windows_support.h"

namespace ecaudit::system {
namespace {

/// A folder cannot be locked itself. The file goes with the last program that has it open.
std::intptr_t OpenMark(const std::string& folder, DWORD share) {
  const std::wstring path = WidePath(folder + "\\.ecaudit-in-use");
  return reinterpret_cast<std::intptr_t>(::CreateFileW(path.c_str(), GENERIC_WRITE | DELETE, share, nullptr,
                                                       OPEN_ALWAYS, FILE_ATTRIBUTE_HIDDEN | FILE_FLAG_DELETE_ON_CLOSE,
                                                       nullptr));
}

void CloseMark(std::intptr_t& handle) {
  if (handle != -1) ::CloseHandle(reinterpret_cast<HANDLE>(handle));
  handle = -1;
}

}  // namespace

FolderHold::FolderHold(const std::string& folder) : folder_(folder) {}

FolderHold::~FolderHold() {
  CloseMark(handle_);
}

FolderHold::Outcome FolderHold::TryAlone() {
  CloseMark(handle_);
  handle_ = OpenMark(folder_, 0);
  if (handle_ != -1) return Outcome::kAlone;
  const DWORD reason = ::GetLastError();
  const bool others = reason == ERROR_SHARING_VIOLATION || reason == ERROR_ACCESS_DENIED;
  return others ? Outcome::kOthers : Outcome::kUnknown;
}

void FolderHold::Share() {
  CloseMark(handle_);
  handle_ = OpenMark(folder_, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE);
}

}  // namespace ecaudit::system
