#include "analyzers/collect/collector.h"
