"""The documents name what the program writes."""
import json
import re
import unittest

from support import SCHEMA, SOURCE


def fields(node, path, found):
    """All fields of a schema by their paths; `found` gets (path, node)."""
    for key, value in node.get("properties", {}).items():
        found.append((path + key, value))
        inner = value.get("items", value) if "items" in value else value
        step = path + key + ("[]." if "items" in value else ".")
        for part in [inner, *inner.get("oneOf", []), *inner.get("anyOf", [])]:
            if "properties" in part:
                fields(part, step, found)
            elif "items" in part:
                fields(part["items"], path + key + "[].", found)
    return found


class Documents(unittest.TestCase):
    def test_every_field_of_the_report_is_described(self):
        schema = json.loads(SCHEMA.read_text())
        page = (SOURCE / "docs" / "report.md").read_text()
        named = set(re.findall(r"^\| `([^`]+)` \|", page, re.M))
        wanted = [path for path, _ in fields(schema, "", [])]
        for name, definition in schema["$defs"].items():
            wanted += [path for path, _ in fields(definition, "", [])]
        self.assertGreater(len(wanted), 400)
        missing = sorted(set(wanted) - named)
        self.assertEqual(missing, [], "docs/report.md lacks rows: | `FIELD` | type, unit | meaning |")
        self.assertEqual(sorted(named - set(wanted)), [], "docs/report.md has rows of fields that are gone")

    def test_links_lead_somewhere(self):
        pages = [SOURCE / "README.md", *sorted((SOURCE / "docs").glob("*.md")), SOURCE / "cli" / "README.md",
                 SOURCE / "tests" / "README.md", SOURCE / "samples" / "descriptions" / "README.md"]
        for page in pages:
            for target in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
                if "://" not in target:
                    self.assertTrue((page.parent / target).exists(), f"{page.name}: {target}")

    def test_the_guide_to_changes_names_this_version(self):
        version = re.search(r"project\(ecaudit VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
        self.assertIn(f"## {version}", (SOURCE / "docs" / "CHANGELOG.md").read_text())


if __name__ == "__main__":
    unittest.main()
