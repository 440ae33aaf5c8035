#include "analyzers/signals/layout_guess.h"

#include <algorithm>
#include <set>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::signals {
namespace {

using device::PdoDirection;

constexpr std::uint16_t kStatusWord = 0x6041;

/// Bytes of the PDOs that the device has by default, sync manager by sync manager.
std::uint32_t DefaultBytes(const device::DeviceDescription& device, PdoDirection direction) {
  std::uint32_t bits[256] = {};
  for (const device::PdoContent& pdo : device.pdo.fixed) {
    if (pdo.direction == direction && pdo.sync_manager) bits[*pdo.sync_manager] += pdo.bits();
  }
  std::uint32_t bytes = 0;
  for (const std::uint32_t of_one : bits) bytes += (of_one + 7) / 8;
  return bytes;
}

/// Where the status word lies; nothing where the device has none, or its inputs lie in several buffers.
std::optional<std::uint32_t> StatusWordAt(const device::DeviceDescription& device) {
  std::optional<std::uint8_t> manager;
  std::optional<std::uint32_t> at;
  std::uint32_t bits = 0;
  for (const device::PdoContent& pdo : device.pdo.fixed) {
    if (pdo.direction != PdoDirection::kTx || !pdo.sync_manager) continue;
    if (manager && *manager != *pdo.sync_manager) return std::nullopt;
    manager = pdo.sync_manager;
    for (const device::PdoEntry& entry : pdo.entries) {
      if (entry.index == kStatusWord && entry.bits == 16 && bits % 8 == 0 && !at) at = bits / 8;
      bits += entry.bits;
    }
  }
  return at;
}

}  // namespace

LayoutGuess::LayoutGuess(const DeviceFiles* files) : files_(files) {
  if (files == nullptr || files->eni) return;
  std::set<std::pair<std::uint32_t, std::uint32_t>> products;
  for (const DeviceFiles::Esi& file : files->esi) {
    for (const device::DeviceDescription& device : file.content.devices) {
      for (const std::uint32_t product : device.match.product_codes) products.emplace(file.content.vendor_id, product);
    }
  }
  if (products.size() != 1) return;
  file_ = &files->esi.front();
  device_ = file_->content.Find(products.begin()->second, 0);
  if (device_ == nullptr) return;
  output_bytes_ = DefaultBytes(*device_, PdoDirection::kRx);
  input_bytes_ = DefaultBytes(*device_, PdoDirection::kTx);
  status_word_ = StatusWordAt(*device_);
  const device::DeviceDescription* generic = device::BuiltinProfile("generic");
  if (generic != nullptr && generic->drive) drive_ = &*generic->drive;
  if (output_bytes_ == 0 || input_bytes_ == 0) device_ = nullptr;
}

std::vector<LayoutGuess::Arrangement> LayoutGuess::Candidates(std::uint16_t length, std::uint16_t wkc) const {
  std::vector<Arrangement> candidates;
  const std::uint32_t count = wkc / 3U;  // a device that is read and written counts 3
  const std::uint32_t data = count * (output_bytes_ + input_bytes_);
  // Some masters map a byte with the state of each mailbox after the data.
  if (count == 0 || wkc % 3U != 0 || (length != data && length != data + count)) return candidates;
  for (const Order order :
       {Order::kOutputsInputs, Order::kInputsOutputs, Order::kOutputsInputsEach, Order::kInputsOutputsEach}) {
    Arrangement a;
    a.order = order;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t each = i * (output_bytes_ + input_bytes_);
      switch (order) {
        case Order::kOutputsInputs:
          a.outputs.push_back(i * output_bytes_);
          a.inputs.push_back(count * output_bytes_ + i * input_bytes_);
          break;
        case Order::kInputsOutputs:
          a.outputs.push_back(count * input_bytes_ + i * output_bytes_);
          a.inputs.push_back(i * input_bytes_);
          break;
        case Order::kOutputsInputsEach:
          a.outputs.push_back(each);
          a.inputs.push_back(each + output_bytes_);
          break;
        case Order::kInputsOutputsEach:
          a.outputs.push_back(each + input_bytes_);
          a.inputs.push_back(each);
          break;
      }
    }
    const bool known = std::ranges::any_of(
        candidates, [&](const Arrangement& other) { return other.outputs == a.outputs && other.inputs == a.inputs; });
    if (!known) candidates.push_back(std::move(a));
  }
  return candidates;
}

bool LayoutGuess::Fits(const Arrangement& arrangement, const track::LogicalAccess& access) const {
  for (const std::uint32_t at : arrangement.outputs) {
    const ByteSpan sent = Slice(access.sent_data, at, output_bytes_);
    const ByteSpan returned = Slice(access.returned_data, at, output_bytes_);
    if (!std::ranges::equal(sent, returned)) return false;
  }
  if (!status_word_ || drive_ == nullptr) return true;
  for (const std::uint32_t at : arrangement.inputs) {
    const auto word = LittleEndian<std::uint16_t>(access.returned_data, at + *status_word_);
    // Zero is a state as well, but what a wrong place shows most often.
    if (word == 0 || !drive_->StateOf(word)) return false;
  }
  return true;
}

void LayoutGuess::Add(const track::LogicalAccess& access) {
  if (device_ == nullptr || !access.sent.seen() || !access.returned.seen() || access.circulating) return;
  if (frames_ > 0 && (access.address != address_ || access.length != length_)) several_ = true;
  if (access.command != wire::Command::LRW) several_ = true;
  if (several_ || access.wkc < wkc_) return;
  if (frames_ == 0 || access.wkc > wkc_) {
    address_ = access.address;
    length_ = access.length;
    wkc_ = access.wkc;
    frames_ = 0;
    left_ = Candidates(length_, wkc_);
  }
  ++frames_;
  std::erase_if(left_, [&](const Arrangement& arrangement) { return !Fits(arrangement, access); });
}

std::optional<LayoutGuess::Found> LayoutGuess::Find() const {
  if (device_ == nullptr || several_ || frames_ < kLeastFrames || left_.size() != 1) return std::nullopt;
  const Arrangement& found = left_.front();
  device::EniConfig config;
  for (std::size_t i = 0; i < found.outputs.size(); ++i) {
    device::EniSlave& slave = config.slaves.emplace_back();
    slave.auto_increment = static_cast<std::uint16_t>(0x10000 - i);
    slave.vendor_id = file_->content.vendor_id;
    slave.product_code = device_->match.product_codes.front();
    slave.revision = device_->match.revision_min;
    slave.outputs.push_back({found.outputs[i] * 8, output_bytes_ * 8});
    slave.inputs.push_back({found.inputs[i] * 8, input_bytes_ * 8});
    for (const device::PdoContent& pdo : device_->pdo.fixed) {
      if (pdo.sync_manager) slave.pdos.push_back(pdo);
    }
  }
  device::EniCyclicCommand command;
  command.command = wire::Command::LRW;
  command.logical = address_;
  command.data_length = length_;
  command.expected_wkc = wkc_;
  command.input_offset = 0;
  command.output_offset = 0;
  config.cyclic.emplace_back().frames.emplace_back().commands.push_back(std::move(command));

  static constexpr const char* kOrders[] = {"outputs of all, then inputs of all", "inputs of all, then outputs of all",
                                            "outputs and inputs of each", "inputs and outputs of each"};
  auto files = std::make_shared<DeviceFiles>(*files_);
  files->eni = {file_->name, std::move(config)};
  return Found{std::move(files), Count(found.outputs.size(), "device") + " of " + file_->name + " in LRW " +
                                     Hex(address_, 8) + ": " + kOrders[static_cast<std::size_t>(found.order)]};
}

}  // namespace ecaudit::signals
