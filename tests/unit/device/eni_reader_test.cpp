#include "decoder/device/eni_reader.h"

#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit::device {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// Written by hand after ETG.2100: two slaves, one of them a drive.
constexpr std::string_view kEni = R"(<?xml version="1.0"?>
<EtherCATConfig Version="1.3">
  <Config>
    <Master>
      <Info><Name>Device 1 (EtherCAT)</Name><Destination>ffffffffffff</Destination><EtherType>a488</EtherType></Info>
      <MailboxStates><StartAddr>150994944</StartAddr><Count>1</Count></MailboxStates>
      <InitCmds>
        <InitCmd>
          <Transition>IP</Transition><Transition>BI</Transition>
          <Comment>read slave count</Comment>
          <Cmd>7</Cmd><Adp>0</Adp><Ado>304</Ado><Data>0000</Data><Retries>0</Retries>
        </InitCmd>
      </InitCmds>
    </Master>
    <Slave>
      <Info><Name>Term 1 (EK1100)</Name><PhysAddr>1001</PhysAddr><AutoIncAddr>0</AutoIncAddr><VendorId>2</VendorId></Info>
    </Slave>
    <Slave>
      <Info>
        <Name><![CDATA[Drive 2 (AKD)]]></Name><PhysAddr>1002</PhysAddr><AutoIncAddr>65535</AutoIncAddr><Physics>YY</Physics>
        <VendorId>106</VendorId><ProductCode>4279108</ProductCode><RevisionNo>2</RevisionNo><SerialNo>0</SerialNo>
      </Info>
      <ProcessData>
        <Send><BitStart>208</BitStart><BitLength>48</BitLength></Send>
        <Recv><BitStart>216</BitStart><BitLength>56</BitLength></Recv>
        <Sm0><Type>MBoxOut</Type><DefaultSize>1024</DefaultSize><StartAddress>6144</StartAddress><ControlByte>38</ControlByte><Enable>1</Enable></Sm0>
        <Sm1><Type>MBoxIn</Type><DefaultSize>1024</DefaultSize><StartAddress>7168</StartAddress><ControlByte>34</ControlByte><Enable>1</Enable></Sm1>
        <Sm2><Type>Outputs</Type><DefaultSize>6</DefaultSize><StartAddress>4352</StartAddress><ControlByte>36</ControlByte><Enable>1</Enable><Pdo>5889</Pdo></Sm2>
        <Sm3><Type>Inputs</Type><StartAddress>#x1140</StartAddress><ControlByte>32</ControlByte><Enable>1</Enable><Pdo>#x1B01</Pdo></Sm3>
        <RxPdo Fixed="1"><Index>#x1701</Index><Name>Position</Name>
          <Entry><Index>#x60C1</Index><SubIndex>1</SubIndex><BitLen>32</BitLen><Name>Position command</Name><DataType>DINT</DataType></Entry>
          <Entry><Index>#x6040</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Control word</Name><DataType>UINT</DataType></Entry>
        </RxPdo>
        <TxPdo Sm="3"><Index>#x1B01</Index>
          <Entry><Index>#x6064</Index><SubIndex>0</SubIndex><BitLen>32</BitLen><DataType>DINT</DataType></Entry>
        </TxPdo>
      </ProcessData>
      <Mailbox>
        <Send><Start>6144</Start><Length>1024</Length></Send>
        <Recv><Start>7168</Start><Length>1024</Length><StatusBitAddr>1</StatusBitAddr></Recv>
        <Protocol>CoE</Protocol>
        <CoE>
          <InitCmds>
            <InitCmd Fixed="1" CompleteAccess="0">
              <Transition>PS</Transition>
              <Comment>clear sm pdos</Comment>
              <Timeout>0</Timeout><Ccs>1</Ccs><Index>7186</Index><SubIndex>0</SubIndex><Data>00</Data>
            </InitCmd>
            <InitCmd>
              <Transition>PS</Transition><Ccs>1</Ccs><Index>#x1C12</Index><SubIndex>1</SubIndex><Data>0117</Data><Disabled>1</Disabled>
            </InitCmd>
          </InitCmds>
        </CoE>
      </Mailbox>
      <InitCmds>
        <InitCmd>
          <Transition>IP</Transition>
          <BeforeSlave>1</BeforeSlave>
          <Comment>set sm0</Comment>
          <Cmd>5</Cmd><Adp>1002</Adp><Ado>2048</Ado><Data>0018000426000100</Data><Cnt>1</Cnt><Retries>3</Retries>
        </InitCmd>
        <InitCmd>
          <Transition>IP</Transition>
          <Cmd>4</Cmd><Adp>1002</Adp><Ado>304</Ado><DataLength>2</DataLength><Cnt>1</Cnt>
          <Validate><Data>0200</Data><DataMask>0f00</DataMask><Timeout>3000</Timeout></Validate>
        </InitCmd>
        <InitCmd><Transition>PI</Transition><Cmd>2</Cmd><Adp>-1</Adp><Ado>16</Ado><Data>ea03</Data></InitCmd>
      </InitCmds>
      <DC><PotentialReferenceClock>true</PotentialReferenceClock><ReferenceClock>1</ReferenceClock>
        <CycleTime0>1000000</CycleTime0><CycleTime1>0</CycleTime1><ShiftTime>-250000</ShiftTime></DC>
    </Slave>
    <Cyclic>
      <CycleTime>1000</CycleTime>
      <Frame>
        <Comment>task 1</Comment>
        <Cmd><State>SAFEOP</State><State>OP</State><Cmd>12</Cmd><Addr>16777216</Addr><DataLength>13</DataLength><Cnt>3</Cnt><InputOffs>26</InputOffs><OutputOffs>26</OutputOffs>
          <CopyInfos><CopyInfo><SrcBitOffs>216</SrcBitOffs><DstBitOffs>320</DstBitOffs><BitSize>64</BitSize></CopyInfo></CopyInfos></Cmd>
        <Cmd><State>OP</State><Cmd>7</Cmd><Adp>0</Adp><Ado>304</Ado><DataLength>2</DataLength><Cnt>2</Cnt></Cmd>
      </Frame>
    </Cyclic>
    <ProcessImage>
      <Inputs><ByteSize>1536</ByteSize>
        <Variable><Name>Drive 2 (AKD).Position.Position actual</Name><Comment>c</Comment><DataType>DINT</DataType><BitSize>32</BitSize><BitOffs>216</BitOffs></Variable>
      </Inputs>
      <Outputs><ByteSize>1024</ByteSize>
        <Variable><Name>Drive 2 (AKD).Position.Control word</Name><DataType>UINT</DataType><BitSize>16</BitSize><BitOffs>240</BitOffs></Variable>
      </Outputs>
    </ProcessImage>
  </Config>
</EtherCATConfig>
)";

EniConfig ReadConfig() {
  Result<EniConfig> config = ReadEni(kEni);
  EXPECT_TRUE(config) << config.error().message;
  return config ? std::move(*config) : EniConfig{};
}

std::string ErrorOf(std::string_view xml) {
  const Result<EniConfig> config = ReadEni(xml);
  return config ? "no error" : config.error().message;
}

TEST(EniReader, ReadsWhatIsCopiedFromSlaveToSlave) {
  const EniConfig config = ReadConfig();
  const std::vector<EniCopy>& copies = config.cyclic.at(0).frames.at(0).commands.at(0).copies;
  ASSERT_EQ(copies.size(), 1U);
  EXPECT_EQ(copies[0].from_bit, 216U);
  EXPECT_EQ(copies[0].to_bit, 320U);
  EXPECT_EQ(copies[0].bits, 64U);
  EXPECT_EQ(config.OutputAt(320, 32), "copy of Drive 2 (AKD).Position.Position actual");
  EXPECT_EQ(config.OutputAt(352, 32), "") << "copied, too, but no variable lies there";
  EXPECT_EQ(config.OutputAt(352, 64), "") << "reaches beyond";
  EXPECT_EQ(config.OutputAt(240, 16), "Drive 2 (AKD).Position.Control word");
}

TEST(EniReader, ShowsHowLongTheMasterWaits) {
  const EniConfig config = ReadConfig();
  const StateTimeouts waits = config.slaves.at(1).Waits();
  EXPECT_EQ(waits.preop, 3'000'000'000);
  EXPECT_EQ(waits.safeop_op, std::nullopt);
  EXPECT_EQ(waits.back_to_init, std::nullopt);
}

TEST(EniReader, ReadsSlaves) {
  const EniConfig config = ReadConfig();
  EXPECT_EQ(config.master_name, "Device 1 (EtherCAT)");
  ASSERT_EQ(config.slaves.size(), 2U);
  EXPECT_EQ(config.slaves[1].name, "Drive 2 (AKD)");
  EXPECT_EQ(config.slaves[1].vendor_id, 0x6AU);
  EXPECT_EQ(config.slaves[1].product_code, 0x00414B44U);
  EXPECT_EQ(config.slaves[1].revision, 2U);
  EXPECT_FALSE(config.slaves[0].product_code);
  EXPECT_EQ(config.slaves[0].position(), 0);
  EXPECT_EQ(config.slaves[1].position(), 1);
  EXPECT_EQ(config.FindByAddress(1002), &config.slaves[1]);
  EXPECT_EQ(config.FindByPosition(1), &config.slaves[1]);
  EXPECT_EQ(config.FindByAddress(1003), nullptr);
  EXPECT_EQ(config.FindByPosition(2), nullptr);
}

TEST(EniReader, ReadsProcessData) {
  const EniSlave slave = ReadConfig().slaves[1];
  ASSERT_EQ(slave.outputs.size(), 1U);
  EXPECT_EQ(slave.outputs[0].bit_start, 208U);
  EXPECT_EQ(slave.inputs[0].bit_length, 56U);
  ASSERT_EQ(slave.sync_managers.size(), 4U);
  EXPECT_EQ(slave.sync_managers[0].start, 0x1800);
  EXPECT_THAT(slave.sync_managers[0].lengths, ElementsAre(1024));
  EXPECT_EQ(slave.sync_managers[0].control, 0x26);
  EXPECT_TRUE(slave.sync_managers[0].mailbox_mode);
  EXPECT_EQ(slave.sync_managers[3].number, 3);
  EXPECT_EQ(slave.sync_managers[3].start, 0x1140);
  EXPECT_THAT(slave.sync_managers[3].lengths, IsEmpty());
  ASSERT_EQ(slave.pdos.size(), 2U);
  EXPECT_EQ(slave.pdos[0].index, 0x1701);
  EXPECT_EQ(slave.pdos[0].sync_manager, 2);  // named by Sm2, which stands before it
  EXPECT_EQ(slave.pdos[0].bits(), 48U);
  EXPECT_EQ(slave.pdos[1].direction, PdoDirection::kTx);
  EXPECT_EQ(slave.pdos[1].sync_manager, 3);
}

TEST(EniReader, ReadsMailboxAndSdoCommands) {
  const EniSlave slave = ReadConfig().slaves[1];
  ASSERT_TRUE(slave.mailbox);
  EXPECT_EQ(slave.mailbox->send_start, 0x1800);
  EXPECT_EQ(slave.mailbox->receive_length, 1024);
  EXPECT_EQ(slave.mailbox->status_bit, 1U);
  EXPECT_FALSE(slave.mailbox->poll_time);
  EXPECT_THAT(slave.mailbox->protocols, ElementsAre("CoE"));
  ASSERT_EQ(slave.sdo_commands.size(), 2U);
  const EniSdoCommand& clear = slave.sdo_commands[0];
  EXPECT_THAT(clear.transitions, ElementsAre("PS"));
  EXPECT_TRUE(clear.fixed);
  EXPECT_FALSE(clear.complete_access);
  EXPECT_FALSE(clear.upload);
  EXPECT_EQ(clear.index, 0x1C12);
  EXPECT_EQ(clear.subindex, 0);
  EXPECT_THAT(clear.data, ElementsAre(0x00));
  EXPECT_EQ(clear.line, 44U);
  EXPECT_THAT(slave.sdo_commands[1].data, ElementsAre(0x01, 0x17));
  EXPECT_TRUE(slave.sdo_commands[1].disabled);
}

TEST(EniReader, ReadsInitCommands) {
  const EniConfig config = ReadConfig();
  ASSERT_EQ(config.master_init_commands.size(), 1U);
  EXPECT_THAT(config.master_init_commands[0].transitions, ElementsAre("IP", "BI"));
  EXPECT_EQ(config.master_init_commands[0].command, wire::Command::BRD);
  const auto& commands = config.slaves[1].init_commands;
  ASSERT_EQ(commands.size(), 3U);
  EXPECT_TRUE(commands[0].before_slave);
  EXPECT_EQ(commands[0].command, wire::Command::FPWR);
  EXPECT_EQ(commands[0].adp, 1002);
  EXPECT_EQ(commands[0].ado, 0x0800);
  EXPECT_THAT(commands[0].data, ElementsAre(0x00, 0x18, 0x00, 0x04, 0x26, 0x00, 0x01, 0x00));
  EXPECT_EQ(commands[0].data_length, 8U);
  EXPECT_EQ(commands[0].expected_wkc, 1);
  EXPECT_EQ(commands[0].retries, 3U);
  EXPECT_EQ(commands[1].data_length, 2U);
  EXPECT_THAT(commands[1].validate_data, ElementsAre(0x02, 0x00));
  EXPECT_THAT(commands[1].validate_mask, ElementsAre(0x0F, 0x00));
  EXPECT_EQ(commands[1].validate_timeout, 3'000'000'000);
  EXPECT_FALSE(commands[2].expected_wkc);
  EXPECT_EQ(commands[2].adp, 0xFFFF);  // written as -1
}

TEST(EniReader, ReadsDistributedClocks) {
  const EniSlave slave = ReadConfig().slaves[1];
  ASSERT_TRUE(slave.dc);
  EXPECT_TRUE(slave.dc->potential_reference);
  EXPECT_TRUE(slave.dc->reference);
  EXPECT_EQ(slave.dc->cycle0, 1'000'000);
  EXPECT_EQ(slave.dc->cycle1, 0);
  EXPECT_EQ(slave.dc->shift, -250'000);
  EXPECT_FALSE(ReadConfig().slaves[0].dc);
}

TEST(EniReader, ReadsCyclicFrames) {
  const EniConfig config = ReadConfig();
  ASSERT_EQ(config.cyclic.size(), 1U);
  EXPECT_EQ(config.cyclic[0].cycle, 1'000'000);
  ASSERT_EQ(config.cyclic[0].frames.size(), 1U);
  const auto& commands = config.cyclic[0].frames[0].commands;
  ASSERT_EQ(commands.size(), 2U);
  EXPECT_THAT(commands[0].states, ElementsAre("SAFEOP", "OP"));
  EXPECT_EQ(commands[0].command, wire::Command::LRW);
  EXPECT_EQ(commands[0].logical, 0x01000000U);
  EXPECT_EQ(commands[0].data_length, 13U);
  EXPECT_EQ(commands[0].expected_wkc, 3);
  EXPECT_EQ(commands[0].input_offset, 26U);
  EXPECT_FALSE(commands[1].input_offset);
}

TEST(EniReader, ReadsTheProcessImage) {
  const EniConfig config = ReadConfig();
  EXPECT_EQ(config.inputs.byte_size, 1536U);
  ASSERT_EQ(config.inputs.variables.size(), 1U);
  EXPECT_EQ(config.inputs.variables[0].name, "Drive 2 (AKD).Position.Position actual");
  EXPECT_EQ(config.inputs.variables[0].data_type, "DINT");
  EXPECT_EQ(config.inputs.variables[0].bit_size, 32U);
  EXPECT_EQ(config.inputs.variables[0].bit_offset, 216U);
  EXPECT_EQ(config.outputs.variables[0].bit_offset, 240U);
}

TEST(EniReader, ErrorsNameLineAndColumn) {
  const auto with = [](std::string_view inside) {
    return "<EtherCATConfig><Config><Slave>\n<InitCmds><InitCmd>" + std::string(inside) +
           "</InitCmd></InitCmds></Slave></Config></EtherCATConfig>";
  };
  EXPECT_EQ(ErrorOf(with("<Cmd>14</Cmd>")), "no error");
  EXPECT_THAT(ErrorOf(with("<Cmd>15</Cmd>")),
              ::testing::AllOf(StartsWith("line 2, column "), HasSubstr("15 is no EtherCAT command")));
  EXPECT_THAT(ErrorOf(with("<Data>0g</Data>")), HasSubstr("\"0g\" is not a row of hexadecimal bytes"));
  EXPECT_THAT(ErrorOf(with("<Data>012</Data>")), HasSubstr("\"012\" is not a row of hexadecimal bytes"));
  EXPECT_THAT(ErrorOf(with("<Adp>70000</Adp>")), HasSubstr("70000 is outside -32768 to 65535"));
  EXPECT_THAT(ErrorOf("<EtherCATInfo/>"), HasSubstr("expected the element EtherCATConfig, got EtherCATInfo"));
  EXPECT_THAT(ErrorOf("<!DOCTYPE x []><EtherCATConfig/>"), HasSubstr("document type declarations are not accepted"));
}

TEST(EniReader, TruncationAnywhereIsAnError) {
  const std::size_t end = kEni.rfind("</EtherCATConfig>") + 16;
  for (std::size_t length = 0; length <= end; length += 13) {
    EXPECT_FALSE(ReadEni(kEni.substr(0, length))) << length;
  }
}

}  // namespace
}  // namespace ecaudit::device
