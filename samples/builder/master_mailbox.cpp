// Mailbox and SDO services of ScriptedMaster (esc-reference 6.2 and 8).
#include <algorithm>
#include <utility>

#include "samples/builder/scripted_master.h"

namespace ecaudit::samples {
namespace {

constexpr TimeNs kAnswerTimeout = 1'000'000'000;

Bytes SdoRequest(std::uint8_t command, std::uint16_t index, std::uint8_t subindex) {
  Bytes out = LeBytes(std::uint16_t{0x2000});
  out.push_back(command);
  AppendLe(out, index);
  out.push_back(subindex);
  return out;
}

}  // namespace

Answer ScriptedMaster::WriteMailbox(std::size_t position, std::uint8_t type, Bytes service) {
  const SiiContent& sii = bus_.slave(position).description().sii;
  std::uint8_t& counter = mailbox_counter_[position];
  if (way_.counts_mail) counter = static_cast<std::uint8_t>(counter % 7 + 1);
  Bytes mail = LeBytes(static_cast<std::uint16_t>(service.size()));
  AppendLe(mail, std::uint16_t{0});
  mail.push_back(0);
  mail.push_back(static_cast<std::uint8_t>(counter << 4U | type));
  AppendBytes(mail, service);
  if (way_.mail == MailPolling::kStatus) Read(position, reg::kSyncManager + 5, 1);
  if (way_.mail == MailPolling::kSyncManager) Read(position, reg::kSyncManager, 8);
  if (way_.writes_last_byte_of_mail && mail.size() < sii.mailbox_out_length) {
    const auto last = static_cast<std::uint16_t>(sii.mailbox_out_start + sii.mailbox_out_length - 1);
    return Exchange({Addressed(position, true, sii.mailbox_out_start, std::move(mail)),
                     Addressed(position, true, last, {0})})
        .front();
  }
  mail.resize(sii.mailbox_out_length, 0);
  return Write(position, sii.mailbox_out_start, std::move(mail));
}

bool ScriptedMaster::HasMail(std::size_t position) {
  switch (way_.mail) {
    case MailPolling::kStatus: {
      const Answer status = Read(position, reg::kSyncManager + 13, 1);
      return status.wkc != 0 && (status.data[0] & 0x08U) != 0;
    }
    case MailPolling::kSyncManager: {
      const Answer all = Read(position, reg::kSyncManager + 8, 8);
      return all.wkc != 0 && (all.data[5] & 0x08U) != 0;
    }
    case MailPolling::kMailbox:
      return true;
  }
  return true;
}

std::optional<Bytes> ScriptedMaster::ReadMailbox(std::size_t position, TimeNs timeout, FrameIds* frame) {
  const SiiContent& sii = bus_.slave(position).description().sii;
  const TimeNs end = now_ + timeout;
  while (now_ < end) {
    if (HasMail(position)) {
      Answer mail = Read(position, sii.mailbox_in_start, sii.mailbox_in_length);
      if (frame != nullptr) *frame = mail.frame;
      if (mail.wkc != 0) return std::move(mail.data);
    }
    Wait(way_.mailbox_interval);
  }
  return std::nullopt;
}

// Waits for the response; emergencies in between are read and dropped.
std::optional<Bytes> ScriptedMaster::AwaitSdo(std::size_t position, SdoAnswer& answer) {
  while (true) {
    const std::optional<Bytes> mail = ReadMailbox(position, kAnswerTimeout, &answer.response);
    if (!mail) return std::nullopt;
    const std::size_t length = LoadLe<std::uint16_t>(*mail, 0);
    const auto begin = mail->begin() + kMailboxHeader;
    Bytes service(begin, begin + static_cast<std::ptrdiff_t>(std::min(length, mail->size() - kMailboxHeader)));
    const bool emergency = ((*mail)[5] & 0x0FU) == 3 && (LoadLe<std::uint16_t>(service, 0) >> 12U) == 1;
    if (!emergency) return service;
  }
}

SdoAnswer ScriptedMaster::Converse(std::size_t position, Bytes sdo) {
  SdoAnswer answer;
  answer.request = WriteMailbox(position, 3, std::move(sdo)).frame;
  const std::optional<Bytes> service = AwaitSdo(position, answer);
  if (!service || service->size() < 3) return answer;
  answer.data = *service;
  if (((*service)[2] >> 5U) == 4) {
    answer.abort_code = LoadLe<std::uint32_t>(*service, 6);
    return answer;
  }
  answer.done = true;
  return answer;
}

SdoAnswer ScriptedMaster::Upload(std::size_t position, std::uint16_t index, std::uint8_t subindex, bool complete) {
  Bytes request = SdoRequest(complete ? 0x50 : 0x40, index, subindex);
  request.resize(10, 0);
  SdoAnswer answer = Converse(position, std::move(request));
  if (!answer.done) return answer;
  const FrameIds first_request = answer.request;
  const std::uint8_t command = answer.data[2];
  if ((command & 0x02U) != 0) {
    const std::size_t count = (command & 0x01U) != 0 ? 4U - (command >> 2U & 0x03U) : 4U;
    answer.data = Bytes(answer.data.begin() + 6, answer.data.begin() + 6 + static_cast<std::ptrdiff_t>(count));
    return answer;
  }
  const std::size_t size = LoadLe<std::uint32_t>(answer.data, 6);
  Bytes value(answer.data.begin() + 10, answer.data.end());
  for (bool toggle = false; value.size() < size; toggle = !toggle) {
    Bytes segment = SdoRequest(static_cast<std::uint8_t>(toggle ? 0x70 : 0x60), index, subindex);
    segment.resize(10, 0);
    answer = Converse(position, std::move(segment));
    if (!answer.done) return answer;
    const std::uint8_t header = answer.data[2];
    std::size_t count = answer.data.size() - 3;
    if (count <= 7) count = std::min<std::size_t>(count, 7U - (header >> 1U & 0x07U));
    value.insert(value.end(), answer.data.begin() + 3, answer.data.begin() + 3 + static_cast<std::ptrdiff_t>(count));
    if ((header & 0x01U) != 0) break;
  }
  answer.request = first_request;
  answer.data = std::move(value);
  return answer;
}

SdoAnswer ScriptedMaster::Download(std::size_t position, std::uint16_t index, std::uint8_t subindex, Bytes data,
                                   bool complete) {
  const std::uint8_t ca = complete ? 0x10 : 0;
  if (data.size() <= 4 && !complete && !data.empty()) {
    Bytes request = SdoRequest(static_cast<std::uint8_t>(0x23U | (4 - data.size()) << 2U), index, subindex);
    AppendBytes(request, data);
    request.resize(10, 0);
    return Converse(position, std::move(request));
  }
  const std::size_t capacity = bus_.slave(position).description().sii.mailbox_out_length - kMailboxHeader;
  Bytes request = SdoRequest(static_cast<std::uint8_t>(0x21U | ca), index, subindex);
  AppendLe(request, static_cast<std::uint32_t>(data.size()));
  std::size_t sent = std::min(data.size(), capacity - request.size());
  AppendBytes(request, ByteView(data).first(sent));
  SdoAnswer answer = Converse(position, std::move(request));
  const FrameIds first_request = answer.request;
  for (bool toggle = false; answer.done && sent < data.size(); toggle = !toggle) {
    const std::size_t count = std::min(data.size() - sent, capacity - 3);
    const bool last = sent + count == data.size();
    const std::size_t unused = count < 7 ? 7 - count : 0;
    Bytes segment = LeBytes(std::uint16_t{0x2000});
    segment.push_back(static_cast<std::uint8_t>((toggle ? 0x10U : 0U) | unused << 1U | (last ? 1U : 0U)));
    AppendBytes(segment, ByteView(data).subspan(sent, count));
    segment.resize(std::max<std::size_t>(segment.size(), 10), 0);
    sent += count;
    answer = Converse(position, std::move(segment));
  }
  answer.request = first_request;
  return answer;
}

}  // namespace ecaudit::samples
