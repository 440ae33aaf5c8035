#include "decoder/device/latch_description.h"

bool Valid(const LatchDescription& latch) {
  for (const LatchEdge& edge : latch.edges) {
    if (edge.valid != 0) return true;
  }
  return false;
}
