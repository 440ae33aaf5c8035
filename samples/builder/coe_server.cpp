#include "samples/builder/coe_server.h"

#include <algorithm>
#include <utility>

namespace ecaudit::samples {
namespace {

constexpr std::size_t kCoeHeader = 2;
constexpr std::uint8_t kTypeError = 0;
constexpr std::uint8_t kTypeCoe = 3;
constexpr std::uint8_t kTypeFoe = 4;
constexpr std::uint16_t kErrorUnsupportedProtocol = 2;
constexpr std::uint16_t kErrorInvalidHeader = 5;
constexpr std::uint16_t kErrorServiceNotSupported = 4;

Bytes Coe(std::uint8_t service) {
  return LeBytes(static_cast<std::uint16_t>(service << 12U));
}

Bytes SdoReply(std::uint8_t command, std::uint16_t index, std::uint8_t subindex) {
  Bytes out = Coe(3);
  out.push_back(command);
  AppendLe(out, index);
  out.push_back(subindex);
  return out;
}

Bytes ErrorReply(std::uint16_t detail) {
  Bytes out = LeBytes(std::uint16_t{1});
  AppendLe(out, detail);
  return out;
}

Bytes FoeError(std::uint32_t code) {
  constexpr std::uint16_t kError = 5;
  Bytes out = LeBytes(kError);
  AppendLe(out, code);
  return out;
}

// Subindex 0 takes 16 bits in complete access, the other entries follow without gaps.
Bytes CompleteValue(const ObjectDictionary& objects, std::uint16_t index, std::uint8_t first) {
  Bytes out;
  for (const auto& [key, entry] : objects.entries()) {
    if (key.first != index || key.second < first) continue;
    AppendBytes(out, entry.value);
    if (key.second == 0) out.push_back(0);
  }
  return out;
}

}  // namespace

void CoeServer::Start(Esc& esc) {
  running_ = true;
  counter_ = 0;
  last_request_counter_ = 0;
  queue_.clear();
  transfer_.reset();
  last_sent_.clear();
  esc.AcknowledgeRepeat(1);
}

void CoeServer::Stop() {
  running_ = false;
  queue_.clear();
}

void CoeServer::QueueEmergency(TimeNs at, std::uint16_t code, std::uint8_t error_register, Bytes data) {
  Pending pending{.at = at};
  pending.service = Coe(1);
  AppendLe(pending.service, code);
  pending.service.push_back(error_register);
  data.resize(5, 0);
  AppendBytes(pending.service, data);
  queue_.push_back(std::move(pending));
}

void CoeServer::Run(TimeNs now, Esc& esc, ObjectDictionary& objects) {
  if (!running_) return;
  if (esc.RepeatRequested(1)) {
    esc.AcknowledgeRepeat(1);
    if (!last_sent_.empty() && !esc.mailbox_full(1)) esc.PutMailbox(1, last_sent_);
  }
  const std::optional<TimeNs> filled = esc.mailbox_filled(0);
  if (filled && esc.mailbox_full(0) && behaviour_.reads_requests && now >= *filled + behaviour_.response_time / 4) {
    const Bytes request = esc.TakeMailbox(0);
    const std::size_t capacity = esc.sync_manager(1).length - kMailboxHeader;
    const std::size_t length = LoadLe<std::uint16_t>(request, 0);
    const std::uint8_t type = request[5] & 0x0FU;
    const std::uint8_t counter = request[5] >> 4U & 0x07U;
    Pending answer{.at = *filled + behaviour_.response_time};
    bool send = behaviour_.answers;
    if (counter != 0 && counter == last_request_counter_) {
      send = false;  // the same request once more
    } else if (length == 0 || length > request.size() - kMailboxHeader) {
      answer.type = kTypeError;
      answer.service = ErrorReply(kErrorInvalidHeader);
    } else if (type == kTypeFoe && behaviour_.foe_error) {
      answer.type = kTypeFoe;
      answer.service = FoeError(*behaviour_.foe_error);
    } else if (type != kTypeCoe) {
      answer.type = kTypeError;
      answer.service = ErrorReply(kErrorUnsupportedProtocol);
    } else {
      const std::optional<Bytes> service = Answer(ByteView(request).subspan(kMailboxHeader, length), objects, capacity);
      if (service) answer.service = *service;
      send = send && service.has_value();
      if (service && service->size() == 4 && LoadLe<std::uint16_t>(*service, 0) == 1) answer.type = kTypeError;
    }
    last_request_counter_ = counter;
    if (send) queue_.push_back(std::move(answer));
  }
  std::stable_sort(queue_.begin(), queue_.end(), [](const Pending& a, const Pending& b) { return a.at < b.at; });
  // One message a visit of the background task: the next one waits some time after the master read the last.
  if (queue_.empty() || now < queue_.front().at || esc.mailbox_full(1)) return;
  if (now < esc.mailbox_read(1) + behaviour_.response_time / 4) return;
  counter_ = Next(counter_);
  Bytes mail = LeBytes(static_cast<std::uint16_t>(queue_.front().service.size()));
  AppendLe(mail, std::uint16_t{0});
  mail.push_back(0);
  mail.push_back(static_cast<std::uint8_t>(counter_ << 4U | queue_.front().type));
  AppendBytes(mail, queue_.front().service);
  if (esc.PutMailbox(1, mail)) {
    last_sent_ = mail;
    queue_.pop_front();
  }
}

std::optional<Bytes> CoeServer::Answer(ByteView service, ObjectDictionary& objects, std::size_t capacity) {
  const unsigned number = LoadLe<std::uint16_t>(service, 0) >> 12U;
  if (number == 2) return Sdo(service, objects, capacity);
  if (number == 8) return Information(service, objects, capacity);
  return ErrorReply(kErrorServiceNotSupported);
}

Bytes CoeServer::Abort(std::uint16_t index, std::uint8_t subindex, std::uint32_t code) {
  transfer_.reset();
  Bytes out = SdoReply(0x80, index, subindex);
  StoreLe(out, 0, static_cast<std::uint16_t>(behaviour_.abort_service << 12U));
  AppendLe(out, code);
  return out;
}

std::optional<Bytes> CoeServer::Sdo(ByteView service, ObjectDictionary& objects, std::size_t capacity) {
  const std::uint8_t command = service.size() > kCoeHeader ? service[kCoeHeader] : 0xE0;
  const auto index = LoadLe<std::uint16_t>(service, 3);
  const std::uint8_t subindex = LoadLe<std::uint8_t>(service, 5);
  switch (command >> 5U) {
    case 0:
      return DownloadSegment(service, objects);
    case 1:
      return InitiateDownload(service, objects);
    case 2:
      return InitiateUpload(index, subindex, (command & 0x10U) != 0, objects, capacity);
    case 3:
      return UploadSegment(command, capacity);
    case 4:
      transfer_.reset();
      return std::nullopt;  // the master aborts
    default:
      return Abort(index, subindex, kAbortCommand);
  }
}

Bytes CoeServer::InitiateUpload(std::uint16_t index, std::uint8_t subindex, bool complete,
                                const ObjectDictionary& objects, std::size_t capacity) {
  transfer_.reset();
  if (!objects.Has(index)) return Abort(index, subindex, kAbortNoObject);
  if (complete && !behaviour_.complete_access) return Abort(index, subindex, kAbortUnsupportedAccess);
  const ObjectEntry* entry = objects.Find(index, subindex);
  if (entry == nullptr) return Abort(index, subindex, kAbortNoSubindex);
  if (!entry->readable) return Abort(index, subindex, kAbortWriteOnly);
  const Bytes value = complete ? CompleteValue(objects, index, subindex) : entry->value;
  if (value.size() <= 4 && !value.empty() && !complete) {
    Bytes out = SdoReply(static_cast<std::uint8_t>(0x43U | (4 - value.size()) << 2U), index, subindex);
    AppendBytes(out, value);
    out.resize(10, 0);
    return out;
  }
  Bytes out = SdoReply(static_cast<std::uint8_t>(0x41U | (complete ? 0x10U : 0U)), index, subindex);
  AppendLe(out, static_cast<std::uint32_t>(value.size()));
  const std::size_t fits = std::min(value.size(), capacity - out.size());
  AppendBytes(out, ByteView(value).first(fits));
  if (fits < value.size()) {
    transfer_ = Transfer{.upload = true, .complete = complete, .index = index, .subindex = subindex};
    transfer_->data = value;
    transfer_->position = fits;
  }
  return out;
}

Bytes CoeServer::UploadSegment(std::uint8_t command, std::size_t capacity) {
  if (!transfer_ || !transfer_->upload) return Abort(0, 0, kAbortCommand);
  const bool toggle = (command & 0x10U) != 0;
  if (toggle != transfer_->toggle) return Abort(transfer_->index, transfer_->subindex, kAbortToggle);
  transfer_->toggle = !transfer_->toggle;
  const std::size_t rest = transfer_->data.size() - transfer_->position;
  const std::size_t count = std::min(rest, capacity - kCoeHeader - 1);
  const bool last = count == rest;
  const std::size_t unused = count < 7 ? 7 - count : 0;
  Bytes out = Coe(3);
  out.push_back(static_cast<std::uint8_t>((toggle ? 0x10U : 0U) | unused << 1U | (last ? 1U : 0U)));
  AppendBytes(out, ByteView(transfer_->data).subspan(transfer_->position, count));
  out.resize(std::max<std::size_t>(out.size(), 10), 0);
  transfer_->position += count;
  if (last) transfer_.reset();
  return out;
}

Bytes CoeServer::InitiateDownload(ByteView service, ObjectDictionary& objects) {
  transfer_.reset();
  const std::uint8_t command = service[kCoeHeader];
  const auto index = LoadLe<std::uint16_t>(service, 3);
  const std::uint8_t subindex = LoadLe<std::uint8_t>(service, 5);
  const bool complete = (command & 0x10U) != 0;
  const bool expedited = (command & 0x02U) != 0;
  if (!objects.Has(index)) return Abort(index, subindex, kAbortNoObject);
  if (complete && !behaviour_.complete_access) return Abort(index, subindex, kAbortUnsupportedAccess);
  Bytes data;
  if (expedited) {
    const std::size_t count = (command & 0x01U) != 0 ? 4U - (command >> 2U & 0x03U) : 4U;
    for (std::size_t i = 0; i < count; ++i) data.push_back(LoadLe<std::uint8_t>(service, 6 + i));
  } else {
    const std::size_t size = LoadLe<std::uint32_t>(service, 6);
    if (service.size() > 10) data.assign(service.begin() + 10, service.end());
    if (data.size() > size) data.resize(size);
    if (data.size() < size) {
      transfer_ = Transfer{.complete = complete, .index = index, .subindex = subindex};
      transfer_->data = data;
      transfer_->size = size;
      Bytes out = SdoReply(0x60, index, subindex);
      out.resize(10, 0);
      return out;
    }
  }
  if (const std::uint32_t code = Store(index, subindex, complete, data, objects)) return Abort(index, subindex, code);
  Bytes out = SdoReply(0x60, index, subindex);
  out.resize(10, 0);
  return out;
}

Bytes CoeServer::DownloadSegment(ByteView service, ObjectDictionary& objects) {
  if (!transfer_ || transfer_->upload) return Abort(0, 0, kAbortCommand);
  const std::uint8_t command = service[kCoeHeader];
  const std::uint16_t index = transfer_->index;
  const std::uint8_t subindex = transfer_->subindex;
  const bool toggle = (command & 0x10U) != 0;
  if (toggle != transfer_->toggle) return Abort(index, subindex, kAbortToggle);
  transfer_->toggle = !transfer_->toggle;
  std::size_t count = service.size() - kCoeHeader - 1;
  if (count <= 7) count = std::min<std::size_t>(count, 7U - (command >> 1U & 0x07U));
  AppendBytes(transfer_->data, service.subspan(kCoeHeader + 1, count));
  if ((command & 0x01U) != 0) {
    const Transfer done = *transfer_;
    transfer_.reset();
    const std::uint32_t code =
        done.data.size() == done.size ? Store(index, subindex, done.complete, done.data, objects) : kAbortLength;
    if (code != 0) return Abort(index, subindex, code);
  }
  Bytes out = Coe(3);
  out.push_back(static_cast<std::uint8_t>(0x20U | (toggle ? 0x10U : 0U)));
  out.resize(10, 0);
  return out;
}

std::uint32_t CoeServer::Store(std::uint16_t index, std::uint8_t subindex, bool complete, ByteView data,
                               ObjectDictionary& objects) {
  if (!complete) return StoreOne(index, subindex, data, objects);
  // The number of entries is set last, as if entry by entry with subindex 0 cleared before.
  std::size_t position = 0;
  std::uint8_t count = 0;
  if (subindex == 0) {
    count = LoadLe<std::uint8_t>(data, 0);
    position = 2;
    if (const std::uint32_t code = StoreOne(index, 0, Bytes{0}, objects)) return code;
  }
  for (const auto& [key, entry] : objects.entries()) {
    if (key.first != index || key.second == 0 || position >= data.size()) continue;
    const std::size_t size = std::min(entry.value.size(), data.size() - position);
    if (const std::uint32_t code = StoreOne(index, key.second, data.subspan(position, size), objects)) return code;
    position += size;
  }
  return subindex == 0 ? StoreOne(index, 0, Bytes{count}, objects) : 0;
}

std::uint32_t CoeServer::StoreOne(std::uint16_t index, std::uint8_t subindex, ByteView data,
                                  ObjectDictionary& objects) {
  ObjectEntry* entry = objects.Find(index, subindex);
  if (entry == nullptr) return kAbortNoSubindex;
  if (!entry->writable) return kAbortReadOnly;
  if (!entry->any_size && data.size() > entry->value.size()) return kAbortTooLong;
  if (!entry->any_size && data.size() < entry->value.size()) return kAbortTooShort;
  if (check_) {
    if (const std::uint32_t code = check_(index, subindex, data)) return code;
  }
  entry->value.assign(data.begin(), data.end());
  return 0;
}

namespace {

Bytes InformationHeader(std::uint8_t answer) {
  Bytes out = Coe(8);
  out.push_back(answer);
  out.push_back(0);
  AppendLe(out, std::uint16_t{0});
  return out;
}

Bytes InformationError(std::uint32_t code) {
  Bytes out = InformationHeader(7);
  AppendLe(out, code);
  return out;
}

// Indices that fit the mailbox, or for list 0 how many there are of each list.
Bytes ObjectList(std::uint16_t list, const ObjectDictionary& objects, std::size_t capacity) {
  std::vector<std::uint16_t> indices;
  for (const auto& [key, entry] : objects.entries()) {
    if (indices.empty() || indices.back() != key.first) indices.push_back(key.first);
  }
  Bytes out = InformationHeader(2);
  AppendLe(out, list);
  if (list == 0) {
    AppendLe(out, static_cast<std::uint16_t>(indices.size()));
    for (int i = 0; i < 4; ++i) AppendLe(out, std::uint16_t{0});
    return out;
  }
  for (const std::uint16_t index : indices) {
    if (out.size() + 2 <= capacity) AppendLe(out, index);
  }
  return out;
}

Bytes ObjectDescription(std::uint16_t index, const ObjectDictionary& objects) {
  std::uint8_t maximum = 0;
  for (const auto& [key, entry] : objects.entries()) {
    if (key.first == index) maximum = key.second;
  }
  const auto first = objects.entries().lower_bound({index, 0});
  Bytes out = InformationHeader(4);
  AppendLe(out, index);
  AppendLe(out, first->second.type);
  out.push_back(maximum);
  out.push_back(maximum == 0 ? 7 : 9);
  AppendText(out, first->second.name);
  return out;
}

Bytes EntryDescription(std::uint16_t index, std::uint8_t subindex, std::uint8_t wanted, const ObjectEntry& entry) {
  Bytes out = InformationHeader(6);
  AppendLe(out, index);
  out.push_back(subindex);
  out.push_back(wanted);
  AppendLe(out, entry.type);
  AppendLe(out, static_cast<std::uint16_t>(entry.value.size() * 8));
  AppendLe(out, static_cast<std::uint16_t>((entry.readable ? 0x07U : 0U) | (entry.writable ? 0x38U : 0U)));
  AppendText(out, entry.name);
  return out;
}

}  // namespace

// Object lists, object and entry descriptions; what does not fit one mailbox is cut.
Bytes CoeServer::Information(ByteView service, const ObjectDictionary& objects, std::size_t capacity) {
  const std::uint8_t opcode = LoadLe<std::uint8_t>(service, kCoeHeader) & 0x7FU;
  const auto index = LoadLe<std::uint16_t>(service, 6);
  if (opcode == 1) return ObjectList(index, objects, capacity);
  if (!objects.Has(index)) return InformationError(kAbortNoObject);
  if (opcode == 3) return ObjectDescription(index, objects);
  if (opcode != 5) return InformationError(kAbortCommand);
  const std::uint8_t subindex = LoadLe<std::uint8_t>(service, 8);
  const ObjectEntry* entry = objects.Find(index, subindex);
  if (entry == nullptr) return InformationError(kAbortNoSubindex);
  return EntryDescription(index, subindex, LoadLe<std::uint8_t>(service, 9), *entry);
}

}  // namespace ecaudit::samples
