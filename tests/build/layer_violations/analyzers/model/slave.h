#include "analyzers/judge/rule.h"
