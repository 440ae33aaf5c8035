#include "cli/report/xml.h"

#include <gtest/gtest.h>

namespace ecaudit::report {
namespace {

TEST(Xml, MarkupBecomesEntities) {
  EXPECT_EQ(XmlText("a<b>&\"c\" 'd'"), "a&lt;b&gt;&amp;&quot;c&quot; 'd'");
}

TEST(Xml, WhatXmlForbidsDoesNotGetThrough) {
  EXPECT_EQ(XmlText(std::string_view("\0\x1b\x7f\x80", 4)), "\\x00\\x1b\\x7f\\x80");
  EXPECT_EQ(XmlText("a\xEF\xBF\xBE"
                    "b\xEF\xBF\xBF"),
            "a\xEF\xBF\xBD"
            "b\xEF\xBF\xBD");
  EXPECT_EQ(XmlText("cut \xE2\x82"), "cut \\xe2\\x82");
}

TEST(Xml, TextStaysAsItIs) {
  EXPECT_EQ(XmlText("Achsregler \xC3\xBC\nline 2"), "Achsregler \xC3\xBC\nline 2");
  EXPECT_EQ(XmlText(""), "");
}

TEST(Xml, WritesElements) {
  XmlWriter xml;
  xml.Begin("a").Attribute("name", "x\ny \"<&\x01\xEF\xBF\xBE").Attribute("count", 7);
  xml.Begin("b").Text("1 < 2\nAchsregler \xC3\xBC \x80\xFC").End().Begin("c").End();
  EXPECT_EQ(xml.Take(),
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
            "<a name=\"x y &quot;&lt;&amp;\\x01\xEF\xBF\xBD\" count=\"7\">\n"
            "  <b>1 &lt; 2\nAchsregler \xC3\xBC \\x80\xC3\xBC</b>\n"
            "  <c/>\n"
            "</a>\n");
}

}  // namespace
}  // namespace ecaudit::report
