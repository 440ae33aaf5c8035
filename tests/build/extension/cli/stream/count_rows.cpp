#include "cli/stream/json_line.h"
#include "cli/stream/row_sink.h"

namespace ecaudit::cli {
namespace {

class CountRows final : public RowSink {
 public:
  explicit CountRows(LineOutput& output) : output_(output) {}

  void Begin(const RowTable& table) override { columns_ = table.columns.size(); }
  void Row(const TableRow& /*row*/) override { ++rows_; }
  void End() override {
    AppendNumber(output_.buffer(), rows_);
    output_.buffer() += " rows of ";
    AppendNumber(output_.buffer(), columns_);
    output_.buffer() += " columns";
    output_.EndLine();
  }

 private:
  LineOutput& output_;
  std::size_t columns_ = 0, rows_ = 0;
};

}  // namespace

std::unique_ptr<RowSink> MakeCountRows(LineOutput& output) {
  return std::make_unique<CountRows>(output);
}

}  // namespace ecaudit::cli
