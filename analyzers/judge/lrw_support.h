/// Slave controllers that support LRW only if outputs and inputs of a slave have the same logical address.
#pragma once

#include "analyzers/judge/rule_context.h"
#include "decoder/base/ids.h"

namespace ecaudit {

/// The controller of the slave is known to be of such a type (0x0000), and its FMMUs map outputs and inputs apart.
/// Later firmware of these controllers supports that, too: a missing working counter shows that this one does not. One
/// that exchanged both outputs and inputs is no such slave.
/// Source: TI-ESC; its errata on LRW access to non-interleaved input and output process data of several slaves.
[[nodiscard]] bool MayRejectSeparateLrw(const RuleContext& context, SlaveId slave);

}  // namespace ecaudit
