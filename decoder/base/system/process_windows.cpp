#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "decoder/base/system/process.h"
#include "decoder/base/system/program.h"
#include "decoder/base/system/signals.h"
#include "decoder/base/system/windows_support.h"

namespace ecaudit::system {
namespace {

/// Handles of a worker: read, write, stop event, shared memory; and the number of bytes of the last one.
constexpr const wchar_t* kVariable = L"ECAUDIT_WORKER";
/// As a worker ends that was ended.
constexpr UINT kEnded = 3;

HANDLE AsHandle(std::uintptr_t number) {
  return reinterpret_cast<HANDLE>(number);
}

std::string LastReason() {
  return "error " + std::to_string(::GetLastError());
}

void CloseIfOpen(HANDLE& handle) {
  if (handle != nullptr) ::CloseHandle(handle);
  handle = nullptr;
}

bool WriteAllTo(HANDLE pipe, std::string_view bytes) {
  while (!bytes.empty()) {
    DWORD written = 0;
    const auto step = static_cast<DWORD>(std::min<std::size_t>(bytes.size(), 1U << 16U));
    if (::WriteFile(pipe, bytes.data(), step, &written, nullptr) == 0) return false;
    bytes.remove_prefix(written);
  }
  return true;
}

bool ReadAllFrom(HANDLE pipe, std::span<char> out) {
  while (!out.empty()) {
    DWORD got = 0;
    const auto step = static_cast<DWORD>(std::min<std::size_t>(out.size(), 1U << 16U));
    if (::ReadFile(pipe, out.data(), step, &got, nullptr) == 0 || got == 0) return false;
    out = out.subspan(got);
  }
  return true;
}

/// All workers are in it: they end with their parent, however that ends.
HANDLE JobOfWorkers() {
  static const HANDLE job = [] {
    const HANDLE made = ::CreateJobObjectW(nullptr, nullptr);
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
    limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
    ::SetInformationJobObject(made, JobObjectExtendedLimitInformation, &limits, sizeof(limits));
    return made;
  }();
  return job;
}

struct Link {
  HANDLE read = nullptr;
  HANDLE write = nullptr;
  HANDLE stop = nullptr;
  HANDLE memory = nullptr;
  std::size_t shared_bytes = 0;
};

/// What the parent left in the environment, taken out of it; nothing in other processes.
std::optional<Link> TakeLink() {
  std::array<wchar_t, 200> text{};
  const DWORD length = ::GetEnvironmentVariableW(kVariable, text.data(), static_cast<DWORD>(text.size()));
  if (length == 0 || length >= text.size()) return std::nullopt;
  ::SetEnvironmentVariableW(kVariable, nullptr);
  std::array<std::uintptr_t, 5> numbers{};
  wchar_t* at = text.data();
  for (std::uintptr_t& number : numbers) number = std::wcstoull(at, &at, 10);
  Link link{AsHandle(numbers[0]), AsHandle(numbers[1]), AsHandle(numbers[2]), AsHandle(numbers[3]), numbers[4]};
  // A variable that a person has set is no way to a parent.
  if (::GetFileType(link.read) != FILE_TYPE_PIPE || ::GetFileType(link.write) != FILE_TYPE_PIPE) return std::nullopt;
  return link;
}

struct OwnTask {
  std::optional<Link> link = TakeLink();
  std::optional<std::string> text;

  OwnTask() {
    if (!link) return;
    std::uint64_t size = 0;
    text.emplace();
    if (!ReadAllFrom(link->read, {reinterpret_cast<char*>(&size), sizeof(size)})) EndAtOnce(kEnded);
    text->resize(static_cast<std::size_t>(size));
    if (!ReadAllFrom(link->read, *text)) EndAtOnce(kEnded);
  }
};

OwnTask& Own() {
  static OwnTask own;
  return own;
}

}  // namespace

struct ParentLink::Parts {
  Link link;
  void* shared;
};

struct Worker::Parts {
  HANDLE process = nullptr;
  HANDLE read = nullptr;
  HANDLE write = nullptr;
  HANDLE stop = nullptr;
  HANDLE memory = nullptr;
  void* shared = nullptr;
};

struct WorkerWait::Parts {
  std::vector<HANDLE> pipes;
  std::vector<bool> ready;
};

ParentLink::ParentLink(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
ParentLink::~ParentLink() = default;

bool ParentLink::Read(std::span<char> out) {
  return ReadAllFrom(parts_->link.read, out);
}

bool ParentLink::Write(std::string_view bytes) {
  return WriteAllTo(parts_->link.write, bytes);
}

void* ParentLink::shared() const {
  return parts_->shared;
}

void ParentLink::ListenForStop(void (*handler)()) {
  // Ctrl-C reaches all programs of a console; the parent forwards it if it is meant.
  ::SetConsoleCtrlHandler(nullptr, TRUE);
  std::thread([handler, stop = parts_->link.stop] {
    if (::WaitForSingleObject(stop, INFINITE) == WAIT_OBJECT_0) handler();
  }).detach();
}

const std::optional<std::string>& WorkerTask() {
  return Own().text;
}

std::unique_ptr<ParentLink> TakeParentLink() {
  const std::optional<Link>& link = Own().link;
  if (!link) return nullptr;
  void* const shared = ::MapViewOfFile(link->memory, FILE_MAP_ALL_ACCESS, 0, 0, link->shared_bytes);
  if (shared == nullptr) EndAtOnce(kEnded);
  return std::make_unique<ParentLink>(std::make_unique<ParentLink::Parts>(ParentLink::Parts{*link, shared}));
}

Worker::Worker() : parts_(std::make_unique<Parts>()) {}
Worker::Worker(Worker&& other) noexcept = default;

Worker::~Worker() {
  if (!parts_) return;
  if (running()) (void)End();
  if (parts_->shared != nullptr) ::UnmapViewOfFile(parts_->shared);
  CloseIfOpen(parts_->memory);
}

std::optional<std::string> Worker::Start(std::size_t shared, const std::string& task,
                                         const std::function<void(ParentLink&)>& /*serve*/) {
  SECURITY_ATTRIBUTES inherited{sizeof(SECURITY_ATTRIBUTES), nullptr, TRUE};
  if (parts_->memory == nullptr) {
    parts_->memory =
        ::CreateFileMappingW(INVALID_HANDLE_VALUE, &inherited, PAGE_READWRITE, 0, static_cast<DWORD>(shared), nullptr);
    if (parts_->memory == nullptr) return LastReason();
    parts_->shared = ::MapViewOfFile(parts_->memory, FILE_MAP_ALL_ACCESS, 0, 0, shared);
    if (parts_->shared == nullptr) return LastReason();
  }
  HANDLE read = nullptr;
  HANDLE write = nullptr;
  const auto fail = [&]() -> std::optional<std::string> {
    std::string reason = LastReason();
    for (HANDLE* handle : {&read, &write, &parts_->read, &parts_->write, &parts_->stop}) CloseIfOpen(*handle);
    return reason;
  };
  if (::CreatePipe(&read, &parts_->write, &inherited, 0) == 0) return fail();
  if (::CreatePipe(&parts_->read, &write, &inherited, 0) == 0) return fail();
  parts_->stop = ::CreateEventW(&inherited, TRUE, FALSE, nullptr);
  if (parts_->stop == nullptr) return fail();
  // The parent's ends are its own, or the worker would never see their end.
  ::SetHandleInformation(parts_->read, HANDLE_FLAG_INHERIT, 0);
  ::SetHandleInformation(parts_->write, HANDLE_FLAG_INHERIT, 0);

  std::wstring variable;
  for (const HANDLE handle : {read, write, parts_->stop, parts_->memory}) {
    variable += std::to_wstring(reinterpret_cast<std::uintptr_t>(handle)) + L" ";
  }
  variable += std::to_wstring(shared);
  std::wstring command = ::GetCommandLineW();
  STARTUPINFOW startup{};
  startup.cb = sizeof(startup);
  PROCESS_INFORMATION process{};
  ::SetEnvironmentVariableW(kVariable, variable.c_str());
  const BOOL started = ::CreateProcessW(WidePath(ProgramPath()).c_str(), command.data(), nullptr, nullptr, TRUE,
                                        CREATE_SUSPENDED, nullptr, nullptr, &startup, &process);
  ::SetEnvironmentVariableW(kVariable, nullptr);
  if (started == 0) return fail();
  ::AssignProcessToJobObject(JobOfWorkers(), process.hProcess);
  ::ResumeThread(process.hThread);
  ::CloseHandle(process.hThread);
  CloseIfOpen(read);
  CloseIfOpen(write);
  ::SetHandleInformation(parts_->stop, HANDLE_FLAG_INHERIT, 0);
  parts_->process = process.hProcess;
  const std::uint64_t size = task.size();
  // If the worker has ended in the meantime, Read() reports it.
  (void)(WriteAllTo(parts_->write, {reinterpret_cast<const char*>(&size), sizeof(size)}) &&
         WriteAllTo(parts_->write, task));
  return std::nullopt;
}

bool Worker::running() const {
  return parts_->process != nullptr;
}

void* Worker::shared() const {
  return parts_->shared;
}

bool Worker::Write(std::string_view bytes) {
  return WriteAllTo(parts_->write, bytes);
}

std::optional<std::size_t> Worker::Read(std::span<char> out) {
  DWORD available = 0;
  if (::PeekNamedPipe(parts_->read, nullptr, 0, nullptr, &available, nullptr) == 0) return std::nullopt;
  DWORD got = 0;
  const auto step = static_cast<DWORD>(std::min<std::size_t>(out.size(), available));
  if (step > 0 && ::ReadFile(parts_->read, out.data(), step, &got, nullptr) == 0) return std::nullopt;
  return got;
}

void Worker::RequestStop() {
  if (running()) ::SetEvent(parts_->stop);
}

Ending Worker::End() {
  // Its reader sees the end; what it works on is not wanted any more.
  CloseIfOpen(parts_->write);
  CloseIfOpen(parts_->read);
  ::WaitForSingleObject(parts_->process, INFINITE);
  DWORD status = 0;
  ::GetExitCodeProcess(parts_->process, &status);
  CloseIfOpen(parts_->process);
  CloseIfOpen(parts_->stop);
  // From here on are the numbers of exceptions.
  constexpr DWORD kFirstException = 0x80000000;
  return {status >= kFirstException, static_cast<unsigned>(status)};
}

WorkerWait::WorkerWait() : parts_(std::make_unique<Parts>()) {}
WorkerWait::~WorkerWait() = default;

void WorkerWait::Add(const Worker& worker) {
  parts_->pipes.push_back(worker.parts_->read);
}

bool WorkerWait::Wait(int ms) {
  // Pipes cannot be waited for.
  constexpr DWORD kStepMs = 1;
  std::vector<bool>& ready = parts_->ready;
  for (const ULONGLONG end = ::GetTickCount64() + static_cast<ULONGLONG>(ms);; ::Sleep(kStepMs)) {
    ready.clear();
    for (const HANDLE pipe : parts_->pipes) {
      DWORD available = 0;
      ready.push_back(::PeekNamedPipe(pipe, nullptr, 0, nullptr, &available, nullptr) == 0 || available > 0);
    }
    if (std::find(ready.begin(), ready.end(), true) != ready.end()) return true;
    if (::GetTickCount64() >= end) return false;
  }
}

bool WorkerWait::Has(std::size_t index) const {
  return index < parts_->ready.size() && parts_->ready[index];
}

}  // namespace ecaudit::system
