-- What `ecaudit wireshark CAPTURE` found, in each frame of the capture: fields to filter, colour, plot and show as columns.
--
-- Reads the side file of the capture (its form: cli/wireshark/side_file.h) and decodes nothing itself. It is found by
--   1. -X lua_script1:FILE, where the script is loaded with -X lua_script:
--   2. the preference ecaudit.side_file
--   3. ecaudit-captures.txt beside this script, by time and length of the first frame: Lua has no name of the capture.
-- Fields must exist before a capture is opened: ecaudit-signals.txt beside this script, and the side file of 1, list
-- the signals. A signal without a field of its own is shown by ecaudit.signal, .name and .value.
--
-- Nothing in a side file is trusted: every number is checked before it is used, and blocks have a longest length.
-- Works with Lua 5.2 (Wireshark 4.0) to 5.4.

local SIGNATURE = "ecaudit-side 1"
local END_LINE = 34            -- "ecaudit-side-end ", 16 digits, line end
local INDEX_LINE = 51          -- three times 16 digits, two spaces, line end
local MOST_BLOCK = 16 * 1024 * 1024
local MOST_DIRECTORY = 64 * 1024 * 1024
local MOST_FIELDS = 8192
local MOST_LISTED = 16 * 1024 * 1024
local MOST_CANDIDATES = 16
local FEW_SIGNALS = 8          -- up to as many are searched for in a row; else all are read
local RECHECK = 256            -- frames between two looks at what a filter refers to

local proto = Proto("ecaudit", "ecaudit analysis")

local names = {}  -- by field
local function Field(kind, name, ...)
  local field = ProtoField[kind](name, ...)
  names[field] = name
  return field
end

local f = {
  stale = Field("string", "ecaudit.stale", "Side file is not used"),
  finding = Field("string", "ecaudit.finding", "Finding"),
  finding_id = Field("string", "ecaudit.finding.id", "Id"),
  finding_rule = Field("string", "ecaudit.finding.rule", "Rule"),
  finding_severity = Field("string", "ecaudit.finding.severity", "Severity"),
  finding_slave = Field("string", "ecaudit.finding.slave", "Slave"),
  finding_message = Field("string", "ecaudit.finding.message", "Message"),
  finding_count = Field("double", "ecaudit.finding.count", "Times"),
  finding_cause = Field("string", "ecaudit.finding.cause", "Consequence of"),
  finding_related = Field("string", "ecaudit.finding.related", "Related to"),
  al_state = Field("string", "ecaudit.al.state", "AL state"),
  al_slave = Field("string", "ecaudit.al.slave", "Slave"),
  al_since = Field("framenum", "ecaudit.al.since", "Since frame"),
  al_code = Field("string", "ecaudit.al.code", "AL status code"),
  al_summary = Field("string", "ecaudit.al.summary", "AL states"),
  al_changed = Field("string", "ecaudit.al.changed", "AL state changes"),
  event = Field("string", "ecaudit.event", "Event"),
  event_type = Field("string", "ecaudit.event.type", "Type"),
  event_slave = Field("string", "ecaudit.event.slave", "Slave"),
  sdo = Field("string", "ecaudit.sdo", "SDO"),
  sdo_slave = Field("string", "ecaudit.sdo.slave", "Slave"),
  sdo_service = Field("string", "ecaudit.sdo.service", "Service"),
  sdo_index = Field("uint16", "ecaudit.sdo.index", "Index", base.HEX),
  sdo_subindex = Field("uint8", "ecaudit.sdo.subindex", "Subindex"),
  sdo_value = Field("string", "ecaudit.sdo.value", "Value"),
  sdo_abort = Field("uint32", "ecaudit.sdo.abort_code", "Abort code", base.HEX),
  sdo_request = Field("framenum", "ecaudit.sdo.request_frame", "Request in", base.NONE, frametype.REQUEST),
  sdo_response = Field("framenum", "ecaudit.sdo.response_frame", "Response in", base.NONE, frametype.RESPONSE),
  sdo_duration = Field("double", "ecaudit.sdo.duration_ms", "Duration in ms"),
  dc_phase = Field("double", "ecaudit.dc.phase", "Frame after SYNC0 in us"),
  dc_slave = Field("string", "ecaudit.dc.slave", "Slave"),
  drive_state = Field("string", "ecaudit.drive.state", "Drive state"),
  drive_command = Field("string", "ecaudit.drive.command", "Drive command"),
  signal = Field("string", "ecaudit.signal", "Signal"),
  signal_name = Field("string", "ecaudit.signal.name", "Name"),
  signal_value = Field("double", "ecaudit.signal.value", "Value"),
}

local arguments = { ... }
local signal_fields = {}  -- by key: { field, is it a number }

-- The folder of this script, with a separator at its end; "" where it is not known.
local function OwnFolder()
  local path = debug and debug.getinfo and debug.getinfo(1, "S").source or ""
  path = string.gsub(path, "^@", "")
  local folder = string.match(path, "^(.*[/\\])[^/\\]*$")
  if not folder and type(__DIR__) == "string" then folder = string.gsub(__DIR__, "([^/\\])$", "%1/") end
  return folder or ""
end
local folder = OwnFolder()

-- A natural number below 2^53, or nothing.
local function Natural(text)
  if not text or not string.find(text, "^%d+$") then return nil end
  local value = tonumber(text)
  if value and value < 9007199254740992 then return value end
  return nil
end

local function Hexadecimal(text)
  local digits = text and string.match(text, "^0*(%x+)$")
  if not digits or #digits > 13 then return nil end
  return tonumber(digits, 16)
end

-- The fields of a line between tabs.
local function Split(line)
  local parts, at, count = {}, 1, 0
  while true do
    local tab = string.find(line, "\t", at, true)
    count = count + 1
    parts[count] = string.sub(line, at, tab and tab - 1 or -1)
    if not tab or count >= 64 then return parts end
    at = tab + 1
  end
end

local function Lines(text)
  return string.gmatch(text, "[^\n]+")
end

local function IsGiven(text)
  return type(text) == "string" and text ~= ""
end

-- The files --------------------------------------------------------------------------------------------------------

local function ReadList(name)
  local file = io.open(folder .. name, "rb")
  if not file then return "" end
  local text = file:read(MOST_LISTED)
  file:close()
  return text or ""
end

local Side = {}
Side.__index = Side

-- Opens a side file: a table, or nothing and why.
function Side.Open(path)
  local file = io.open(path, "rb")
  if not file then return nil, nil end
  local self = setmetatable({ file = file, path = path, sections = {}, columns = {}, layouts = {}, findings = {},
                              marks = {}, checks = {} }, Side)
  local why = self:ReadDirectory()
  if not why then return self, nil end
  file:close()
  return nil, why
end

function Side:Close()
  if self.file then self.file:close() end
  self.file = nil
end

function Side:Read(offset, length)
  if not self.file or offset < 0 or length < 0 or offset + length > self.size then return nil end
  if length == 0 then return "" end
  if not self.file:seek("set", offset) then return nil end
  local text = self.file:read(length)
  if not text or #text ~= length then return nil end
  return text
end

function Side:ReadDirectory()
  self.size = self.file:seek("end") or 0
  local begin = self:Read(0, #SIGNATURE + 1)
  if begin ~= SIGNATURE .. "\n" then
    return begin and string.sub(begin, 1, 13) == "ecaudit-side " and "it is of another version of ecaudit" or
        "it is no side file of ecaudit"
  end
  local last = self:Read(self.size - END_LINE, END_LINE)
  local offset = last and Hexadecimal(string.match(last, "^ecaudit%-side%-end (%x+)\n$"))
  if not offset or offset > self.size - END_LINE then return "it is not complete" end
  local length = self.size - END_LINE - offset
  if length > MOST_DIRECTORY then return "it is damaged" end
  local text = self:Read(offset, length)
  if not text then return "it cannot be read" end
  for line in Lines(text) do
    local part = Split(line)
    local take = self["Take_" .. part[1]]
    if take then take(self, part) end
  end
  if not self.packets then return "it is damaged" end
  return nil
end

function Side:Take_capture(part)
  self.capture_size, self.packets = Natural(part[2]), Natural(part[3])
  self.first_time, self.first_length = tonumber(part[4] or ""), Natural(part[5])
  self.capture_path = part[6]
end

function Side:Take_check(part)
  local frame, length = Natural(part[2]), Natural(part[3])
  if frame and length then self.checks[frame] = { length, string.lower(part[4] or "") } end
end

function Side:Take_column(part)
  local number = Natural(part[2])
  if not number or number > 65536 then return end
  local slave, name, unit = part[4] or "", part[5] or "", part[6] or ""
  self.columns[part[2]] = {
    kind = part[3] or "", slave = slave, key = part[8] or "",
    title = (slave ~= "" and slave .. "." or "") .. name,
    unit = unit ~= "" and " " .. unit or "",
    shows_unit = unit == "" or string.find(name, "[" .. unit .. "]", 1, true) ~= nil,
  }
end

function Side:Take_layout(part)
  local number = Natural(part[2])
  if not number then return end
  local columns = {}
  for column in string.gmatch(part[3] or "", "%d+") do
    columns[#columns + 1] = column
    if #columns > 65536 then break end
  end
  self.layouts[number] = columns
end

function Side:Take_finding(part)
  local number = Natural(part[2])
  if not number then return end
  self.findings[number] = { id = part[3] or "", severity = part[4] or "", rule = part[5] or "", slave = part[6] or "",
                            count = Natural(part[7]) or 1, cause = part[8] or "", title = part[9] or "",
                            message = part[10] or "" }
end

function Side:Take_mark(part)
  local frame, finding = Natural(part[2]), Natural(part[3])
  if not frame or not finding then return end
  local list = self.marks[frame] or {}
  list[#list + 1] = { finding, part[4] or "" }
  self.marks[frame] = list
end

function Side:Take_section(part)
  local offset, count = Natural(part[3]), Natural(part[4])
  if not offset or not count or offset + count * INDEX_LINE > self.size then return end
  self.sections[part[2] or ""] = { offset = offset, count = count }
end

-- Frame, offset and length of a block; the first is 0.
function Side:IndexEntry(section, number)
  local line = self:Read(section.offset + number * INDEX_LINE, INDEX_LINE)
  local frame, offset, length = string.match(line or "", "^(%x+) (%x+) (%x+)\n$")
  return Hexadecimal(frame), Hexadecimal(offset), Hexadecimal(length)
end

-- Makes the block at hand the last one that begins at or before `frame`; false when there is none.
function Side:Seek(section, frame)
  if section.at and frame >= section.from and frame < section.to then return true end
  if section.count == 0 or (section.none_below and frame < section.none_below) then return false end
  local low, high = 0, section.count
  if section.at and section.at + 1 < section.count and frame == section.to then
    low = section.at + 1
    high = low + 1
  end
  while low + 1 < high do
    local middle = math.floor((low + high) / 2)
    local begin = self:IndexEntry(section, middle)
    if not begin then return false end
    if begin <= frame then low = middle else high = middle end
  end
  local begin, offset, length = self:IndexEntry(section, low)
  if not begin or not offset or not length or length > MOST_BLOCK then return false end
  if begin > frame then
    section.none_below = begin
    return false
  end
  local text = self:Read(offset, length)
  if not text then return false end
  local following = low + 1 < section.count and self:IndexEntry(section, low + 1) or nil
  section.at, section.from, section.to = low, begin, following or math.huge
  section.text, section.place, section.state, section.values, section.row, section.done = text, 1, {}, {}, nil, nil
  section.rows, section.summary, section.sorted = nil, nil, false
  return true
end

-- The lines of a frame in a section whose lines stand for themselves, without the frame.
function Side:LinesOf(name, frame)
  local section = self.sections[name]
  if not section or not self:Seek(section, frame) then return nil end
  if not section.rows then
    local rows = {}
    for number, line in string.gmatch(section.text, "(%d+)\t([^\n]*)\n") do
      number = tonumber(number)
      local list = rows[number]
      if list then
        list[#list + 1] = line
      else
        rows[number] = { line }
      end
    end
    section.rows, section.text = rows, ""
  end
  return section.rows[frame]
end

-- Applies the lines of a section of changes up to `frame`.
function Side:Advance(name, frame, apply)
  local section = self.sections[name]
  if not section or not self:Seek(section, frame) then return nil end
  if section.done and section.done > frame then
    section.place, section.state, section.values, section.row, section.summary = 1, {}, {}, nil, nil
  end
  section.done = frame
  local text, place = section.text, section.place
  while place <= #text do
    local finish = string.find(text, "\n", place, true)
    if not finish then
      place = #text + 1
      break
    end
    local number = tonumber(string.match(text, "^(%d+)\t", place))
    if number then
      if number > frame then break end
      apply(section, number, string.sub(text, place, finish - 1))
    end
    place = finish + 1
  end
  section.place = place
  return section
end

local function ApplyState(section, frame, line)
  local part = Split(line)
  local slave, state, code, states = part[2] or "", part[3] or "?", part[4] or "", section.state
  if not states["=" .. slave] then
    states[#states + 1] = slave
    section.sorted = false
  end
  states["=" .. slave] = { state = state, since = frame, code = code,
                           label = slave .. " AL state: " .. state .. (code ~= "" and ", " .. code or "") }
  section.summary = nil
end

local function ApplyRow(section, frame, line)
  local state, values, few = section.state, section.values, section.few
  section.row, section.layout = frame, tonumber(string.match(line, "^%d+\t(%d+)"))
  if not few then
    for column, text in string.gmatch(line, "\t(%d+)=([^\t]*)") do
      state[column], values[column] = text, nil
    end
    return
  end
  for column, begin in pairs(few) do
    local _, finish = string.find(line, begin, 1, true)
    if finish then state[column], values[column] = string.match(line, "^[^\t]*", finish + 1), nil end
  end
end

-- Fields of signals ------------------------------------------------------------------------------------------------

local field_count = 0
local function AddSignalField(key, kind, title)
  if signal_fields[key] or field_count >= MOST_FIELDS then return end
  if not string.find(key, "^[a-z0-9_.]+$") or string.find(key, "..", 1, true) or #key > 200 or
      string.find(key, "^%.") or string.find(key, "%.$") or key == "name" or key == "value" then
    return
  end
  local made, field = pcall(Field, kind == "n" and "double" or "string", "ecaudit.signal." .. key,
                            title ~= "" and title or key)
  if not made then return end
  field_count = field_count + 1
  signal_fields[key] = { field, kind == "n" }
  f["signal." .. key] = field
end

for line in Lines(ReadList("ecaudit-signals.txt")) do
  local part = Split(line)
  AddSignalField(part[1] or "", part[2] or "s", part[3] or "")
end
local given = arguments[1]
if IsGiven(given) then
  local side = Side.Open(given)
  if side then
    for _, column in pairs(side.columns) do
      AddSignalField(column.key, column.kind == "number" and "n" or "s", column.title)
    end
    side:Close()
  end
end

proto.fields = f
local severities = {
  error = ProtoExpert.new("ecaudit.expert.error", "ecaudit error", expert.group.PROTOCOL, expert.severity.ERROR),
  warning = ProtoExpert.new("ecaudit.expert.warning", "ecaudit warning", expert.group.PROTOCOL, expert.severity.WARN),
  info = ProtoExpert.new("ecaudit.expert.info", "ecaudit info", expert.group.PROTOCOL, expert.severity.NOTE),
}
local stale_expert = ProtoExpert.new("ecaudit.expert.stale", "ecaudit: the side file is not used",
                                     expert.group.PROTOCOL, expert.severity.WARN)
proto.experts = { severities.error, severities.warning, severities.info, stale_expert }
proto.prefs.side_file = Pref.string("Side file", "", "File of 'ecaudit wireshark'; empty: found by the first frame")
proto.prefs.only = Pref.string("Only these fields", "", "For tshark -T fields and -V, which build all fields of " ..
                               "each frame: names between commas, * at the end for any text; empty: all")

-- The capture at hand ----------------------------------------------------------------------------------------------

local side         -- nothing: no side file
local others = {}  -- paths of those that are tried next
local why_stale    -- why none is used
local begun        -- the first frame was seen
local first_frame  -- its length and time
local wanted       -- what to show: the fields that are referred to
local add          -- TreeItem.add: its name is looked up once, for a call into Wireshark is what most items cost
local looked       -- the last frame

local function Forget()
  if side then side:Close() end
  side, others, why_stale, begun, wanted, looked = nil, {}, nil, false, nil, nil
end

local function SameTime(a, b)
  return a and b and math.abs(a - b) < 2e-6
end

-- Side files of captures that begin so, the newest first.
local function Candidates(time, length)
  if IsGiven(given) then return { given } end
  if IsGiven(proto.prefs.side_file) then return { proto.prefs.side_file } end
  local paths = {}
  for line in Lines(ReadList("ecaudit-captures.txt")) do
    local part = Split(line)
    local untimed = part[1] == "" and time == 0
    if Natural(part[2]) == length and part[3] and (untimed or SameTime(tonumber(part[1]), time)) then
      paths[#paths + 1] = part[3]
      if #paths >= MOST_CANDIDATES then break end
    end
  end
  return paths
end

-- Why the side file is of another capture, or of an earlier state of this one.
local function WhyStale(candidate)
  if candidate.first_length ~= first_frame.length or
      (candidate.first_time and not SameTime(candidate.first_time, first_frame.time)) then
    return "it is of another capture"
  end
  local file = IsGiven(candidate.capture_path) and io.open(candidate.capture_path, "rb")
  local size = file and file:seek("end")
  if file then file:close() end
  if size and candidate.capture_size and size ~= candidate.capture_size then
    return string.format("the capture had %.0f bytes when it was written and has %.0f now", candidate.capture_size,
                         size)
  end
  return nil
end

-- Takes the first of `others` that may be of this capture, and leaves those after it.
local function TakeNext()
  while #others > 0 do
    local path = table.remove(others, 1)
    local candidate, why = Side.Open(path)
    if candidate then why = WhyStale(candidate) end
    if candidate and not why then
      side, wanted = candidate, nil
      return
    end
    if candidate then candidate:Close() end
    if why then why_stale = why_stale or (path .. ": " .. why) end
  end
end

local function GiveUp(why)
  why_stale = why_stale or (side.path .. ": " .. why)
  side:Close()
  side = nil
  TakeNext()
end

-- Why a frame is not the one that was analysed; some of them are checked.
local function WhyOther(tvb, pinfo)
  if pinfo.number > side.packets then return "the capture is longer than when it was written" end
  local check = side.checks[pinfo.number]
  if not check then return nil end
  local length = math.min(tvb:len(), math.floor(#check[2] / 2))
  local bytes = length > 0 and string.lower(tvb:range(0, length):bytes():tohex()) or ""
  if check[1] == pinfo.len and bytes == string.sub(check[2], 1, #bytes) then return nil end
  return "frame " .. pinfo.number .. " is not the one that was analysed"
end

-- A function that returns whether a field is in the list of the preference; nothing when it is empty.
local function ListedFields()
  local whole, begins = {}, {}
  for name in string.gmatch(proto.prefs.only or "", "[^,%s]+") do
    local begin = string.match(name, "^(.*)%*$")
    if begin then begins[#begins + 1] = begin else whole[name] = true end
  end
  if not next(whole) and #begins == 0 then return nil end
  return function(field)
    local name = names[field]
    if whole[name] then return true end
    for _, begin in ipairs(begins) do
      if string.sub(name, 1, #begin) == begin then return true end
    end
    return false
  end
end

-- What a filter, a column or an open window asks for.
local function FindWanted(tree)
  local found = { all = tree.visible, any = false, signals = {}, plans = {} }
  -- Of a visible tree Wireshark answers that all fields are referred to.
  local listed = found.all and ListedFields()
  local function Refers(field)
    if listed then return listed(field) end
    return found.all or tree:referenced(field)
  end
  local function Group(name, ...)
    for _, key in ipairs({ ... }) do
      if Refers(f[key]) then
        found[name], found.any = true, true
        return
      end
    end
  end
  Group("states", "al_state", "al_slave", "al_since", "al_code", "al_summary", "al_changed")
  Group("each_state", "al_state", "al_slave", "al_since", "al_code", "al_changed")
  Group("events", "event", "event_type", "event_slave", "sdo", "sdo_slave", "sdo_service", "sdo_index", "sdo_subindex",
        "sdo_value", "sdo_abort", "sdo_request", "sdo_response", "sdo_duration")
  Group("clocks", "dc_phase", "dc_slave")
  Group("generic", "signal", "signal_name", "signal_value")
  Group("drives", "drive_state", "drive_command")
  found.rows = found.generic or found.drives
  local chosen = {}
  for number, column in pairs(side.columns) do
    local own = signal_fields[column.key]
    local drive = column.kind == "state" or column.kind == "command"
    if found.generic or (drive and found.drives) or (own and Refers(own[1])) then
      found.signals[number], found.rows, found.any = true, true, true
      chosen[#chosen + 1] = number
    end
  end
  if #chosen <= FEW_SIGNALS then
    table.sort(chosen)
    found.few, found.few_names = {}, table.concat(chosen, " ")
    for _, number in ipairs(chosen) do found.few[number] = "\t" .. number .. "=" end
  end
  return found
end

local function AddFindings(tree, pinfo)
  for _, mark in ipairs(side.marks[pinfo.number]) do
    local finding, role = side.findings[mark[1]], mark[2]
    if finding and role == "related" then
      add(tree, f.finding_related,
          finding.id .. " " .. finding.severity .. " " .. finding.rule .. ": " .. finding.title)
    elseif finding then
      local item = add(tree, f.finding, finding.id .. " " .. finding.title)
      add(item, f.finding_id, finding.id)
      add(item, f.finding_severity, finding.severity)
      add(item, f.finding_rule, finding.rule)
      add(item, f.finding_slave, finding.slave)
      add(item, f.finding_message, finding.message)
      add(item, f.finding_count, finding.count)
      if finding.cause ~= "" then add(item, f.finding_cause, finding.cause) end
      local kind = severities[finding.severity]
      if role ~= "last" and kind then
        item:add_proto_expert_info(kind, finding.id .. " " .. finding.rule .. ", " .. finding.slave .. ": " ..
                                   finding.title)
      end
    end
  end
end

-- "OP 3, SAFEOP+ERR 1"; of one slave "OP".
local function Summary(section)
  local counts, names = {}, {}
  for _, slave in ipairs(section.state) do
    local state = section.state["=" .. slave].state
    if not counts[state] then names[#names + 1] = state end
    counts[state] = (counts[state] or 0) + 1
  end
  if #section.state == 1 then return names[1] end
  for i, name in ipairs(names) do names[i] = name .. " " .. counts[name] end
  return table.concat(names, ", ")
end

local function SlaveOrder(a, b)
  local x, y = tonumber(string.match(a, "^S(%d+)$") or ""), tonumber(string.match(b, "^S(%d+)$") or "")
  if x and y then return x < y end
  if x or y then return x ~= nil end
  return a < b
end

local function AddStates(tree, pinfo)
  local section = side:Advance("al", pinfo.number, ApplyState)
  if not section or #section.state == 0 then return end
  if not section.sorted then
    table.sort(section.state, SlaveOrder)
    section.sorted = true
  end
  section.summary = section.summary or Summary(section)
  local all = add(tree, f.al_summary, section.summary)
  if not wanted.each_state then return end
  local number = pinfo.number
  for _, slave in ipairs(section.state) do
    local state = section.state["=" .. slave]
    local item
    if wanted.all then
      item = add(all, f.al_state, state.state, state.label)
    else
      item = add(all, f.al_state, state.state)
    end
    add(item, f.al_slave, slave)
    if state.since < 4294967296 then add(item, f.al_since, state.since) end
    if state.code ~= "" then add(item, f.al_code, state.code) end
    if state.since == number then add(all, f.al_changed, slave .. " " .. state.state) end
  end
end

local function AddSdo(tree, part)
  local item = add(tree, f.sdo, (part[2] ~= "" and part[2] .. " " or "") .. part[3])
  local function Text(field, text)
    if IsGiven(text) then add(item, field, text) end
  end
  local function Number(field, text, first, limit)
    local value = Natural(text)
    if value and value >= first and value < limit then add(item, field, value) end
  end
  Text(f.sdo_slave, part[2])
  Text(f.sdo_service, part[4])
  Number(f.sdo_index, part[5], 0, 65536)
  Number(f.sdo_subindex, part[6], 0, 256)
  Text(f.sdo_value, part[11])
  Number(f.sdo_abort, part[9], 0, 4294967296)
  Number(f.sdo_request, part[7], 1, 4294967296)
  Number(f.sdo_response, part[8], 1, 4294967296)
  local duration = tonumber(part[10] or "")
  if duration then add(item, f.sdo_duration, duration) end
end

local function AddEvents(tree, pinfo)
  local lines = side:LinesOf("events", pinfo.number)
  if not lines then return end
  for _, line in ipairs(lines) do
    local part = Split(line)
    if part[1] == "sdo" and part[3] then
      AddSdo(tree, part)
    elseif part[3] then
      local item = add(tree, f.event, (part[2] ~= "" and part[2] .. " " or "") .. part[3])
      add(item, f.event_type, part[1])
      if part[2] ~= "" then add(item, f.event_slave, part[2]) end
    end
  end
end

local function AddClocks(tree, pinfo)
  local lines = side:LinesOf("clocks", pinfo.number)
  if not lines then return end
  for _, line in ipairs(lines) do
    local slave, ns = string.match(line, "^([^\t]*)\t(-?%d+)$")
    if ns then
      local us = tonumber(ns) / 1000
      local item
      if wanted.all then
        item = add(tree, f.dc_phase, us, string.format("%s: end of the frame %.3f us after SYNC0", slave, us))
      else
        item = add(tree, f.dc_phase, us)
      end
      add(item, f.dc_slave, slave)
    end
  end
end

-- What to add for the columns of a layout, as far as anything asks for it. A plain column shows its own field and
-- nothing else: what it adds is kept in the values of the section until the signal changes.
local function PlanOf(layout)
  local columns = side.layouts[layout or -1]
  if not columns then return nil end
  local plan = { steps = {}, numbers = {}, plain = {} }
  for _, number in ipairs(columns) do
    local column = side.columns[number]
    if column and wanted.signals[number] then
      local own = signal_fields[column.key]
      local drive = wanted.drives and
          (column.kind == "state" and f.drive_state or column.kind == "command" and f.drive_command) or nil
      local generic = wanted.generic and not (own and wanted.all)
      local plain = own and not drive and not generic and (column.shows_unit or not wanted.all)
      local place = #plan.steps + 1
      plan.steps[place] = { number = number, column = column, own = own and own[1], of_number = own and own[2],
                            drive = drive, plain = plain }
      plan.numbers[place] = number
      plan.plain[place] = plain and own[1] or false
    end
  end
  wanted.plans[layout] = plan
  return plan
end

local function AddDriveWord(tree, step, text)
  if not wanted.all then return add(tree, step.drive, text) end
  local column = step.column
  if column.labelled ~= text then
    column.labelled = text
    column.label = (column.slave ~= "" and column.slave .. " " or "") ..
        (column.kind == "state" and "drive state: " or "drive command: ") .. text
  end
  add(tree, step.drive, text, column.label)
end

local function AddColumn(tree, step, section)
  local text = section.state[step.number]
  if not text then return end
  local column, value = step.column, tonumber(text)
  local has_own = step.own and (not step.of_number or value)
  if has_own then
    local shown = text
    if step.of_number then shown = value end
    local item = add(tree, step.own, shown)
    if step.plain then section.values[step.number] = shown end
    if wanted.all and not column.shows_unit then item:append_text(column.unit) end
  end
  if wanted.generic and not (has_own and wanted.all) then
    local item = add(tree, f.signal, column.title .. ": " .. text .. column.unit)
    add(item, f.signal_name, column.title)
    if value then add(item, f.signal_value, value) end
  end
  if step.drive and text ~= "?" then AddDriveWord(tree, step, text) end
end

local function AddSignals(tree, pinfo)
  local rows = side.sections.signals
  if rows and rows.few_names ~= wanted.few_names then
    -- What was read of the block lacks other signals: it is read again.
    rows.few, rows.few_names, rows.done = wanted.few, wanted.few_names, math.huge
  end
  local section = side:Advance("signals", pinfo.number, ApplyRow)
  if not section or section.row ~= pinfo.number then return end
  local plan = wanted.plans[section.layout or -1] or PlanOf(section.layout)
  if not plan then return end
  local image = wanted.all and add(tree, proto, "Process data") or tree
  local values, steps, numbers, plain = section.values, plan.steps, plan.numbers, plan.plain
  for i = 1, #steps do
    local field = plain[i]
    local value = field and values[numbers[i]]
    if value then
      add(image, field, value)
    else
      AddColumn(image, steps[i], section)
    end
  end
end

local function ShowStale(tree, pinfo)
  if pinfo.number ~= 1 and not tree.visible and not tree:referenced(f.stale) then return end
  local text = why_stale .. "; run 'ecaudit wireshark' again"
  local item = add(tree, proto, "ecaudit: the side file is not used")
  add(item, f.stale, text)
  if pinfo.number == 1 then item:add_proto_expert_info(stale_expert, text) end
end

local function Show(tvb, pinfo, tree, number)
  add = add or tree.add
  if not begun then
    -- Every capture begins with frame 1.
    if number ~= 1 then return end
    begun = true
    first_frame = { length = pinfo.len, time = tonumber(pinfo.abs_ts) or 0 }
    others = Candidates(first_frame.time, first_frame.length)
    TakeNext()
  end
  while side do
    local why = WhyOther(tvb, pinfo)
    if not why then break end
    GiveUp(why)
  end
  if not side then
    if why_stale then ShowStale(tree, pinfo) end
    return
  end
  if not wanted or number ~= looked + 1 or number % RECHECK == 0 or tree.visible ~= wanted.all then
    wanted = FindWanted(tree)
  end
  looked = number
  local marked = side.marks[number]
  if not wanted.any and not marked then return end
  local top = wanted.all and add(tree, proto, "ecaudit analysis"):set_generated() or tree
  if marked then AddFindings(top, pinfo) end
  if wanted.states then AddStates(top, pinfo) end
  if wanted.events then AddEvents(top, pinfo) end
  if wanted.clocks then AddClocks(top, pinfo) end
  if wanted.rows then AddSignals(top, pinfo) end
end

function proto.init()
  Forget()
end

function proto.prefs_changed()
  wanted = nil
end

function proto.dissector(tvb, pinfo, tree)
  local number = pinfo.number
  -- Most frames while a capture is read: nothing refers to a field, and the frame before was alike.
  if wanted and side and not wanted.any and number == looked + 1 and number % RECHECK ~= 0 and
      not side.marks[number] and not side.checks[number] and number <= side.packets and not tree.visible then
    looked = number
    return
  end
  local fine, why = pcall(Show, tvb, pinfo, tree, number)
  if fine then return end
  -- A side file that leads here is damaged: it is left alone from now on.
  if side then GiveUp("it is damaged") end
  if os.getenv("ECAUDIT_LUA_ERRORS") then io.stderr:write("ecaudit.lua: " .. tostring(why) .. "\n") end
end

register_postdissector(proto)
