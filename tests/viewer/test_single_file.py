import json
import re

import pytest

from internav_data.records.errors import InternavError, UsageError
from internav_data.viewer import respond, write_page


@pytest.fixture(scope="module")
def page(viewed, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    assert write_page(viewed, path, 2) == 2
    return path.read_text()


def test_it_holds_the_servers_answers(page, viewed):
    text = page.partition('id="embedded">')[2].partition("</script>")[0]
    answers = json.loads(text)
    rows = answers["/api/episodes"]
    assert [(row["scene_id"], row["index"]) for row in rows] == [
        ("scene-000002", 0),
        ("scene-000001", 11),
    ]
    for row in rows:
        url = f"/api/episode/{row['scene_id']}/{row['index']}"
        assert answers[url] == json.loads(respond(viewed, url).body)
        steps = len(answers[f"{url}/play"]["moments"])
        assert all(answers[f"{url}/play/{k}"].startswith("data:image/webp") for k in range(steps))
        assert f"{url}/thumbnail" in answers
        assert f"{url}/model" in answers
    assert answers["/api/dataset"]["episodes"] == 2


def test_it_fetches_nothing(page):
    outside = page.replace("http://www.w3.org", "").split('id="embedded"')[0]
    assert not re.search(r"""(?:src|href)=["'](?!#|data:)""", outside)
    assert "http" not in outside.split("</style>")[0]


def test_bad_samples_and_places_are_said(viewed, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(UsageError, match="1 to 200 episodes, got 0"):
        write_page(viewed, tmp_path / "x.html", 0)
    with pytest.raises(InternavError, match="cannot be written"):
        write_page(viewed, blocked / "x.html", 1)
