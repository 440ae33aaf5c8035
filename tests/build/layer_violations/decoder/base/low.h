#include "decoder/wire/high.h"
