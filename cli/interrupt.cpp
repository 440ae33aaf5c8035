#include "cli/interrupt.h"

#include <csignal>

namespace ecaudit::cli {
namespace {

std::atomic<bool> interrupted = false;

void OnSignal(int signal_number) {
  interrupted = true;
  std::signal(signal_number, SIG_DFL);
}

}  // namespace

void ListenForInterrupt() {
  interrupted = false;
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
}

std::atomic<bool>& InterruptFlag() {
  return interrupted;
}

}  // namespace ecaudit::cli
