"""Write a trained agent without what only training needs, to be handed on.

python examples/ship_agent.py runs/camp-0 my-agent
camp-eval my-agent data/mine
"""

import sys

from internav_data import export_agent

run, folder = sys.argv[1:3]
print("wrote", export_agent(run, folder))
