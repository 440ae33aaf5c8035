/// `ecaudit events`: what was reconstructed from the datagrams.
#include <memory>
#include <string>
#include <vector>

#include "cli/commands/command.h"
#include "cli/stream/event_writer.h"
#include "cli/stream/stream_formats.h"
#include "cli/stream/stream_run.h"

namespace ecaudit::cli {
namespace {

class EventsCommand : public Command {
 public:
  EventsCommand()
      : Command("events", "events CAPTURE", "Show what happened: states, register writes, mailboxes, SDO transfers") {}

  void Declare(OptionSet& options) override {
    run_.Declare(options, StreamFormats::OfEvents());
    options.Group("What to read");
    options.Values("--type", "TYPE,...", types_,
                   "only events of these types (repeatable); ecat-event is shown only if it is named");
    std::vector<std::string> types;
    for (std::size_t i = 0; i < kEventTypes; ++i) types.emplace_back(Name(static_cast<EventType>(i)));
    options.Words(std::move(types));
    std::string list = EventTypeList();
    if (const std::size_t middle = list.find(" emergency"); middle != std::string::npos) list[middle] = '\n';
    options.Footer("\nTypes:\n" + list +
                   ".\nWithout --type the text omits register writes that al-request and eeprom lines "
                   "show.\nExample: ecaudit events --type sdo,emergency --slave 0 trace.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    const Result<EventTypes> types = EventTypes::Parse(types_);
    if (!types) {
      console.Error(types.error().message);
      return ExitStatus::kUsage;
    }
    EventWriter writer(*types);
    return run_.Run(console, writer, name());
  }

 private:
  StreamRun run_;
  std::vector<std::string> types_;
};

}  // namespace

std::unique_ptr<Command> MakeEventsCommand() {
  return std::make_unique<EventsCommand>();
}

}  // namespace ecaudit::cli
