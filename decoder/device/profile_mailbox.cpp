/// Reads the section "mailbox" of a profile.

#include "decoder/device/profile_sections.h"

namespace ecaudit::device {
namespace {

/// "out" is from the master to the drive, as the manuals use it.
void ReadRequest(const Cursor& cursor, bool& out) {
  static constexpr Word<bool> kWords[] = {{"out", true}, {"in", false}};
  ReadWord(cursor, kWords, out);
}

}  // namespace

static void Read(const Cursor& cursor, SyncManagerRule& out) {
  ObjectReader object(cursor);
  object.Require("number", out.number);
  object.AllowWith("use", [&](const Cursor& at) { ReadWord(at, kSyncManagerUses, out.use); });
  object.Allow("start", out.start);
  object.Allow("lengths", out.lengths);
  object.Allow("max_length", out.max_length);
  FinishRow(object, cursor, out.note, out.source);
  out.mailbox_mode = out.use == SyncManagerUse::kMailboxOut || out.use == SyncManagerUse::kMailboxIn;
  out.master_writes = out.use == SyncManagerUse::kMailboxOut || out.use == SyncManagerUse::kProcessOut;
}

static void Read(const Cursor& cursor, MailboxSize& out) {
  ObjectReader object(cursor);
  object.Require("direction", out.direction);
  object.Allow("start", out.start);
  object.Require("bytes", out.bytes);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, MailboxProtocol& out) {
  ObjectReader object(cursor);
  object.Require("type", out.type);
  object.Require("name", out.name);
  object.Allow("reserved", out.reserved);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, CoeService& out) {
  ObjectReader object(cursor);
  object.AllowWith("value", [&](const Cursor& at) { ReadBits(at, out.first, out.last); });
  object.Require("meaning", out.meaning);
  object.Allow("reserved", out.reserved);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, SdoCommandByte& out) {
  ObjectReader object(cursor);
  object.AllowWith("direction", [&](const Cursor& at) { ReadRequest(at, out.request); });
  object.Require("byte", out.value);
  object.Require("meaning", out.meaning);
  object.Allow("data_bytes", out.data_bytes);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, MailboxByte& out) {
  ObjectReader object(cursor);
  object.AllowWith("direction", [&](const Cursor& at) { ReadRequest(at, out.request); });
  object.Require("byte", out.byte);
  object.AllowWith("bits", [&](const Cursor& at) { ReadBits(at, out.first, out.last); });
  object.Require("meaning", out.meaning);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, MailboxExampleByte& out) {
  ObjectReader object(cursor);
  object.AllowWith("direction", [&](const Cursor& at) { ReadRequest(at, out.request); });
  object.Require("byte", out.byte);
  object.Require("value", out.value);
  object.Require("meaning", out.meaning);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, MailboxFile& out) {
  ObjectReader object(cursor);
  object.Require("name", out.name);
  object.Require("suffix", out.suffix);
  object.Require("states", out.states);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, MailboxDescription& out) {
  ObjectReader object(cursor);
  object.Allow("sync_managers", out.sync_managers);
  object.Allow("sizes", out.sizes);
  object.Allow("protocols", out.protocols);
  object.Allow("coe_services", out.coe_services);
  object.Allow("sdo_commands", out.sdo_commands);
  object.Allow("layout", out.layout);
  object.Allow("example", out.example);
  object.Allow("files", out.files);
  FinishRow(object, cursor, out.note, out.source);
}

}  // namespace ecaudit::device
