/// What is reported about working counters, and the notes that findings about them get.
#pragma once

#include "analyzers/result/finding_kind.h"

namespace ecaudit::wkc {

inline constexpr FindingKind kProcessData{
    .name = "process-data",
    .title = R"({command} working counter {working_counter} instead of [{!expected_most}at least
{expected_least}][[{?as_range}{expected_least} to ]{expected_most}][{!missing}[{?no_inputs}: one slave delivers no
inputs]][{?apart}: maybe FMMUs must overlap])",
    .message = R"({command} of {length} at logical address {logical_address} returned in {frame} with
working counter {working_counter}. Expected [{!expected_most}at least {expected_least}][[{?as_range}{expected_least} to
]{expected_most}][, by the FMMUs of the slaves: {shares}].[{!shares} No slave has an FMMU for this address.])",
    .next =
        R"([{?apart}Map outputs and inputs of each slave to the same logical address, or use LRD and LWR. If that does
not help: ][{?outputs_of}Check the AL status of {outputs_of} and the sync manager of its
outputs[ (SM{sync_manager})].][{?inputs_of}Check the AL status of {inputs_of} and the sync manager of its
inputs[ (SM{sync_manager})].][{!outputs_of}[{!inputs_of}[{?missing}Check AL status, power and cable of
{missing}.][{!missing}[{?more_counted}Check which slaves have FMMUs for this address.][{!more_counted}[{?no_inputs}Find
the slave whose inputs never change, and check that its application (processor) runs.][{!no_inputs}Check AL status and
power of the slaves.]]]]])",
    .identity = "command"};
inline constexpr FindingKind kDropped{
    .name = "process-data-dropped",
    .title = "{command} working counter {working_counter} instead of {before} as before",
    .message = R"({command} of {length} at logical address {address} returned in {frame} with working counter
{working_counter}. Before, it was {before} in {times} from {since_frame} on, and there was no state request since
then.[{!missing} The capture does not show which slave is missing.])",
    .next = "Check AL status, power and cable of [{missing}][{!missing}the slaves].",
    .identity = "command"};
inline constexpr FindingKind kBroadcast{
    .name = "broadcast",
    .title = "BRD of {register}: {working_counter} of {passed} answer",
    .message =
        R"(The broadcast read of register {register} in {frame} passed {passed}, and every ESC has this register.
But the working counter is {working_counter}. A broadcast does not show which slave did not answer.)",
    .next = "Check which slave does not answer the reads of its own address.",
    .identity = "register"};
inline constexpr FindingKind kNoAnswer{
    .name = "no-answer",
    .title = "The slave does not answer at its station address {station_address}",
    .message = R"(FPRD of register {register} at station address {station_address} returned in {frame} with
working counter 0, although a slave answered there [in {answered_frame}][{!answered_frame}before]. The slave lost power, its
link, or its address. A restart clears the address.)",
    .next = "Check the power of the slave and the cable to it."};
inline constexpr FindingKind kSeveralAnswer{
    .name = "several-answer",
    .title = "{working_counter} slaves answer at station address {station_address}",
    .message =
        R"(FPRD of register {register} returned in {frame} with working counter {working_counter} instead of 1. So
{working_counter} slaves have station address {station_address}, and their data are mixed.)",
    .next = "Give each slave an address of its own."};
inline constexpr FindingKind kNoSlaveThere{
    .name = "no-slave",
    .title = "No slave answers at station address {station_address}",
    .message =
        R"([{?assigned}The master accesses station address {station_address} {accesses} from {frame} to {last_frame},
first register {register}, and the working counter is always 0. It assigned other addresses in the capture, but not this
one.[ So no slave takes what it writes to [{?mailbox}the mailbox at ][{!mailbox}register ]{written_register} there.]][{!assigned}The master accesses station
address {station_address} {accesses} from {frame} to {last_frame}, first register {register}, which every slave has. The
working counter is always 0, but other slaves answer. The slave lost power, its link or its address before the capture,
or no slave ever had this address.])",
    .next =
        "[{?assigned}Compare the station addresses in the configuration of the master with those that it assigns "
        "(0x0010).][{!assigned}Check the power of this slave and the cable to it, and the station addresses in the "
        "configuration of the master.]",
    .identity = "station_address"};
inline constexpr FindingKind kNoSlaveAtPosition{
    .name = "no-slave-at-position",
    .title = "No slave at position {position}: the last one is at {last_position}",
    .message =
        R"(The master accesses position {position} {accesses} from {frame} to {last_frame}, first register {register}. The
working counter is always 0. The frames passed {slaves}, so there is no slave at this position.)",
    .next =
        "Compare number and order of the slaves in the configuration of the master with the bus. Check power and cable "
        "after position {last_position}.",
    .identity = "position"};

inline constexpr NoteKind kLeftTheBus{.name = "left-the-bus",
                                      .text = "The shares of {slaves} are missing. These slaves left the bus."};
inline constexpr NoteKind kAllAway{
    .name = "do-not-answer",
    .text = "The shares of {slaves} are missing. These slaves do not answer at their station addresses either."};
inline constexpr NoteKind kMoreCounted{.name = "more-than-have-fmmus",
                                       .text = "More slaves took part than have FMMUs for this address."};
inline constexpr NoteKind kOutputsMissing{.name = "outputs-missing",
                                          .text = "The outputs of {slave} are missing: it does not accept them."};
inline constexpr NoteKind kInputsMissing{.name = "inputs-missing",
                                         .text = "The inputs of {slave} are missing: it does not deliver them."};
inline constexpr NoteKind kShareMissing{.name = "share-missing", .text = "The share of {slave} is missing."};
inline constexpr NoteKind kSeveralFit{.name = "several-fit",
                                      .text = R"(The difference of {difference} fits the shares of several
slaves.[{?inputs} One is what a slave counts for its inputs. It does not count while its application has written none.])"};
inline constexpr NoteKind kFitsSlaveThatLeftState{
    .name = "fits-slave-that-left-state",
    .text = "The difference of {difference} fits the share of {slave}, which left its AL state."};
inline constexpr NoteKind kOneAway{.name = "one-does-not-answer",
                                   .text = "One of them is {slave}, which does not answer at its station address."};
inline constexpr NoteKind kOneLeft{.name = "one-left-the-bus", .text = "One of them is {slave}, which left the bus."};
inline constexpr NoteKind kFitsAlone{
    .name = "fits-alone", .text = "Only {slave} has the share that is missing from all datagrams since {since}."};
inline constexpr NoteKind kInputsNotRefreshed{
    .name = "inputs-not-refreshed",
    .text = R"(The inputs of {slave} returned unchanged in all of these frames, and those of the other slaves were
refreshed. So {slave} does not take part.)"};
inline constexpr NoteKind kSeparateLrw{
    .name = "separate-lrw",
    .text =
        R"({slaves} {slaves?has a controller|have controllers} of type 0x90 (0x0000, TI PRU-ICSS), and the FMMUs map the
outputs and inputs of a slave to different logical addresses. Older firmware of these controllers does not support that
with LRW.)"};
inline constexpr NoteKind kOneBuffer{
    .name = "one-buffer",
    .text =
        R"([{?several}These sync managers have one buffer: {managers}. Each slave][{!several}{managers} has one buffer. The
slave] counts only if it has [{?inputs}filled][{!inputs}emptied] the buffer.)"};

}  // namespace ecaudit::wkc
