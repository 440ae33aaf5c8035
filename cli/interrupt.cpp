#include "cli/interrupt.h"

#include "decoder/base/system/process.h"
#include "decoder/base/system/signals.h"

namespace ecaudit::cli {
namespace {

std::atomic<bool> interrupted = false;

void OnInterrupt() {
  interrupted = true;
}

}  // namespace

void ListenForInterrupt() {
  interrupted = false;
  system::ListenForInterrupt(OnInterrupt);
}

void ListenForStop(system::ParentLink& parent) {
  interrupted = false;
  parent.ListenForStop(OnInterrupt);
}

std::atomic<bool>& InterruptFlag() {
  return interrupted;
}

}  // namespace ecaudit::cli
