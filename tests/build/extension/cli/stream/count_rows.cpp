#include "cli/stream/json_line.h"
#include "cli/stream/stream_formats.h"

namespace ecaudit::cli {
namespace {

void AppendCount(LineOutput& output, std::size_t count, std::string_view what) {
  AppendNumber(output.buffer(), count);
  output.buffer() += what;
}

class CountSignals final : public SignalSink {
 public:
  explicit CountSignals(LineOutput& output) : output_(output) {}

  void Begin(const SignalTable& table) override { columns_ = table.columns.size(); }
  void Row(const SignalRow& /*row*/) override { ++rows_; }
  void End() override {
    AppendCount(output_, rows_, " rows of ");
    AppendCount(output_, columns_, " columns");
    output_.EndLine();
  }

 private:
  LineOutput& output_;
  std::size_t columns_ = 0, rows_ = 0;
};

class CountEvents final : public EventSink {
 public:
  explicit CountEvents(LineOutput& output) : output_(output) {}

  void Begin(const EventTable& /*table*/) override {}
  void Row(const EventRecord& /*row*/) override { ++rows_; }
  void End() override {
    AppendCount(output_, rows_, " events");
    output_.EndLine();
  }

 private:
  LineOutput& output_;
  std::size_t rows_ = 0;
};

class CountDatagrams final : public DatagramSink {
 public:
  explicit CountDatagrams(LineOutput& output) : output_(output) {}

  void Begin(const DatagramTable& /*table*/) override {}
  void Row(const DatagramRow& /*row*/) override { ++rows_; }
  void End() override {
    AppendCount(output_, rows_, " datagrams");
    output_.EndLine();
  }

 private:
  LineOutput& output_;
  std::size_t rows_ = 0;
};

}  // namespace

StreamFormat CountFormat() {
  return {.output = {"count", ".txt"},
          .help = "count: their number",
          .signals = &MakeRows<SignalSink, CountSignals>,
          .events = &MakeRows<EventSink, CountEvents>,
          .datagrams = &MakeRows<DatagramSink, CountDatagrams>};
}

}  // namespace ecaudit::cli
