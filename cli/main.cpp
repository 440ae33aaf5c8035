#include <cstdio>

#include "cli/program.h"
#include "decoder/base/system/program.h"

int main(int argc, char** argv) {
  return ecaudit::cli::RunProgram(ecaudit::system::Arguments(argc, argv), stdout, stderr);
}
